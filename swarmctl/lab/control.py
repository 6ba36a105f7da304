"""The wire between ``swarmctl lab`` and a lab's supervisor: one JSON line each way over a Unix socket."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from swarmctl.lab.errors import LabError

Answer = Callable[[Mapping[str, str]], Mapping[str, Any]]


def ask(path: Path, request: Mapping[str, str], timeout: float = 10.0) -> dict[str, Any]:
    """The supervisor's answer. Raises ``LabError`` when it refuses, and ``OSError`` when nobody answers."""
    with socket.socket(socket.AF_UNIX) as connection, _reachable(path) as address:
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
    """A listening socket at ``path``, for root alone."""
    path.unlink(missing_ok=True)
    server = socket.socket(socket.AF_UNIX)
    with _reachable(path) as address:
        server.bind(address)
    path.chmod(0o600)
    server.listen()
    return server


def serve(server: socket.socket, answer: Answer) -> None:
    """Answer requests one after the other, for ever. A client that breaks off or stalls costs only itself."""
    while True:
        connection, _ = server.accept()
        with connection, suppress(OSError, ValueError):
            connection.settimeout(5.0)
            with connection.makefile("rwb") as stream:
                stream.write(_line(_answered(_request(stream.readline(1 << 16)), answer)))


def _request(line: bytes) -> Mapping[str, str]:
    """What was asked. Raises ``ValueError`` for anything but one flat object of texts."""
    request = json.loads(line)
    if not isinstance(request, dict) or not all(isinstance(value, str) for value in request.values()):
        raise ValueError("not a request")
    return request


def _answered(request: Mapping[str, str], answer: Answer) -> Mapping[str, Any]:
    try:
        return answer(request)
    except LabError as error:
        return {"error": str(error), "help": error.help_lines}
    except OSError as error:
        return {"error": f"the lab's supervisor could not do that: {error}"}


def _line(message: Mapping[str, Any]) -> bytes:
    return json.dumps(message).encode() + b"\n"


@contextmanager
def _reachable(path: Path) -> Iterator[str]:
    """``path`` by a name short enough for a socket address (108 bytes)."""
    folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)
