"""Many hosts that cost little: SSH servers which replay to everybody what one agent answered."""

from __future__ import annotations

import io
import json
import logging
import multiprocessing
import os
import re
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import paramiko
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from swarmctl.remote.transport import Target

Answers = Mapping[str, Mapping[str, Any]]  # by verb
_BACKLOG = 512


@dataclass(frozen=True)
class RecordedHosts:
    """The servers: each stands for any number of hosts."""

    ports: tuple[int, ...]
    pids: tuple[int, ...]
    key: str
    identity: Path

    def target(self, host: str) -> Target:
        """Returns how to reach a host of this name."""
        port = self.ports[hash(host) % len(self.ports)]
        return Target(host, "127.0.0.1", "robot", port, (self.key,), (self.identity,))


@contextmanager
def running(folder: Path, answers: Answers, processes: int = 1) -> Iterator[RecordedHosts]:
    """Starts the servers; an answer whose ``release`` is None has the one that the request knows."""
    host_key, identity = (_new_key() for _ in range(2))
    (path := folder / "identity").write_text(identity)
    path.chmod(0o600)
    shown = paramiko.Ed25519Key(file_obj=io.StringIO(host_key))
    context = multiprocessing.get_context("spawn")
    started = []
    for _ in range(processes):
        ours, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(host_key, dict(answers), theirs), daemon=True)
        process.start()
        started.append((process, ours))
    try:
        ports = tuple(int(ours.recv()) for _process, ours in started)
        pids = tuple(int(process.pid or 0) for process, _ours in started)
        yield RecordedHosts(ports, pids, f"{shown.get_name()} {shown.get_base64()}", path)
    finally:
        for process, _ours in started:
            process.kill()
            process.join()


def _new_key() -> str:
    key = Ed25519PrivateKey.generate()
    return key.private_bytes(Encoding.PEM, PrivateFormat.OpenSSH, NoEncryption()).decode()


def _serve(host_key: str, answers: Answers, parent: Connection) -> None:
    logging.disable()  # each end of a connection is an error for paramiko
    key = paramiko.Ed25519Key(file_obj=io.StringIO(host_key))
    with socket.create_server(("127.0.0.1", 0), backlog=_BACKLOG) as listener:
        parent.send(listener.getsockname()[1])
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
        while True:
            connection, _ = listener.accept()
            threading.Thread(target=_login, args=(connection, key, answers), daemon=True).start()


def _end_with(parent: Connection) -> None:
    with suppress(EOFError, OSError):
        parent.recv()
    os._exit(0)


def _login(connection: socket.socket, key: paramiko.PKey, answers: Answers) -> None:
    with suppress(paramiko.SSHException, EOFError, OSError):  # an operator that has gone
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        transport = paramiko.Transport(connection)
        transport.add_server_key(key)
        transport.start_server(event=threading.Event(), server=_Host(answers))


class _Host(paramiko.ServerInterface):
    """Lets everybody in, and runs one program: the agent."""

    def __init__(self, answers: Answers) -> None:
        self._answers = answers

    def get_allowed_auths(self, username: str) -> str:
        return "publickey"

    def check_auth_publickey(self, username: str, key: paramiko.PKey) -> int:
        return paramiko.AUTH_SUCCESSFUL

    def check_channel_request(self, kind: str, chanid: int) -> int:
        return paramiko.OPEN_SUCCEEDED

    def check_channel_exec_request(self, channel: paramiko.Channel, command: bytes) -> bool:
        found = re.search(rb"sh ([0-9a-f]{16}) ", command)
        nonce = found[1] if found else b""
        threading.Thread(target=self._replay, args=(channel, nonce), daemon=True).start()
        return True

    def _replay(self, channel: paramiko.Channel, nonce: bytes) -> None:
        with suppress(OSError, EOFError), channel.makefile("rb") as requests:
            while line := requests.readline():
                request = json.loads(line)
                requests.read(request["payload"])
                answer = dict(self._answers[request["verb"]])
                if "release" in answer and answer["release"] is None:
                    answer["release"] = request["known_release"]
                text = json.dumps({"answer": answer}, separators=(",", ":")).encode()
                channel.sendall(b"@" + nonce + b" " + text + b"\n")
