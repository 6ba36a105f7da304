"""Requests from ``swarmctl lab`` to a lab's supervisor: one JSON line each way over a Unix socket."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from swarmctl.lab.errors import LabError

Handler = Callable[[Mapping[str, str]], Mapping[str, Any]]


def send(path: Path, request: Mapping[str, str], timeout: float = 10.0) -> dict[str, Any]:
    """Sends a request and returns the answer.

    Raises ``LabError`` if it is refused, ``OSError`` if nobody answers.
    """
    with socket.socket(socket.AF_UNIX) as connection, _short_path(path) as address:
        connection.settimeout(timeout)
        connection.connect(address)
        with connection.makefile("rwb") as stream:
            stream.write(_line(request))
            stream.flush()
            line = stream.readline()
    if not line:
        raise ConnectionResetError(f"{path} closed without an answer")
    answer: dict[str, Any] = json.loads(line)
    if "error" in answer:
        raise LabError(answer["error"], *answer.get("help", ()))
    return answer


def listen(path: Path) -> socket.socket:
    """Returns a listening socket at ``path`` that only root can open."""
    path.unlink(missing_ok=True)
    server = socket.socket(socket.AF_UNIX)
    with _short_path(path) as address:
        server.bind(address)
    path.chmod(0o600)
    server.listen()
    return server


def serve(server: socket.socket, handler: Handler) -> None:
    """Answers requests one by one and never returns.

    A client that disconnects or stalls is dropped after 5 s.
    """
    while True:
        connection, _ = server.accept()
        with connection, suppress(OSError, ValueError):
            connection.settimeout(5.0)
            with connection.makefile("rwb") as stream:
                stream.write(_line(_handled(_request(stream.readline(1 << 16)), handler)))


def _request(line: bytes) -> Mapping[str, str]:
    """Parses a request. Raises ``ValueError`` for anything but one flat object of strings."""
    request = json.loads(line)
    if not isinstance(request, dict) or not all(isinstance(value, str) for value in request.values()):
        raise ValueError("not a request")
    return request


def _handled(request: Mapping[str, str], handler: Handler) -> Mapping[str, Any]:
    try:
        return handler(request)
    except LabError as error:
        return {"error": str(error), "help": error.help_lines}
    except OSError as error:
        return {"error": f"the lab's supervisor failed: {error}"}


def _line(message: Mapping[str, Any]) -> bytes:
    return json.dumps(message).encode() + b"\n"


@contextmanager
def _short_path(path: Path) -> Iterator[str]:
    """Yields a name for ``path`` that fits a socket address (108 bytes)."""
    folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)
