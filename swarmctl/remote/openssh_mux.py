"""Sessions over a connection that the program ``ssh`` has: its protocol for that, PROTOCOL.mux version 4.

``ssh`` itself would do (``ssh -S CONTROL HOST COMMAND``), as one more process for each command, and it does
not distinguish a command that ended with 255 from a connection that was lost.
"""

from __future__ import annotations

import os
import socket
import struct
from contextlib import suppress
from pathlib import Path

from swarmctl.remote.ssh_errors import lost, unfinished

_VERSION = 4
_HELLO = 0x00000001
_NEW_SESSION = 0x10000002
_FAILURES = (0x80000002, 0x80000003)  # permission denied; failure
_ALIVE_CHECK = 0x10000004
_EXIT_MESSAGE = 0x80000004
_IS_ALIVE = 0x80000005
_OPENED = 0x80000006
_NO_ESCAPE = 0xFFFFFFFF
_REQUEST = 1
_LONGEST = 1 << 18  # bytes, as for ssh itself
_ALIVE = 2.0  # s in which ssh should answer whether it has its connection
_KILLED = -1  # the status of a command that a signal ended


class RefusedError(Exception):
    """The host opens no further session now."""


class MuxSession:
    """One command on the host, with the operator's ends of its three pipes."""

    def __init__(self, control: Path, host: str, command: str, timeout: float) -> None:
        """Starts the command. Raises ``HostError``, or ``RefusedError`` if the host opens no session."""
        self._control = control
        self._host = host
        self._status: int | None = None
        theirs: list[int] = []
        ours: list[int] = []
        self._messages = _Messages()
        try:
            self._messages.connect(control, timeout)
            for _ in range(3):
                read, write = os.pipe()
                theirs.append(write if ours else read)
                ours.append(read if ours else write)
            self._start(command, theirs)
            self._messages.socket.setblocking(False)
        except BaseException as error:
            self._close_all(ours)
            if isinstance(error, TimeoutError):
                raise unfinished(host, timeout) from error
            if isinstance(error, OSError):
                raise lost(host) from error
            raise
        finally:
            for descriptor in theirs:
                os.close(descriptor)
        self.stdin, self.stdout, self.stderr = ours

    def fileno(self) -> int:
        """Readable when ``status`` may have changed."""
        return self._messages.socket.fileno()

    def status(self) -> int | None:
        """The exit status of the command; None while it runs, -1 if a signal ended it.

        Raises ``HostError`` if the connection is gone.
        """
        with suppress(BlockingIOError):
            while self._status is None:
                found = self._messages.receive()
                if found is None:
                    self._status = self._without_status()
                elif found[0] == _EXIT_MESSAGE:
                    self._status = struct.unpack(">I", found[1][4:8])[0]
        return self._status

    def close(self) -> None:
        """Ends the session: the standard input of the command ends, and its output is no longer read."""
        self._close_all([self.stdin, self.stdout, self.stderr])

    def _close_all(self, descriptors: list[int]) -> None:
        self._messages.socket.close()
        for descriptor in descriptors:
            os.close(descriptor)

    def _start(self, command: str, streams: list[int]) -> None:
        flags = struct.pack(">IIIII", 0, 0, 0, 0, _NO_ESCAPE)  # no terminal, X11, agent; no subsystem
        self._messages.send(_NEW_SESSION, _text("") + flags + _text("") + _text(command))
        for descriptor in streams:
            socket.send_fds(self._messages.socket, [b"\0"], [descriptor])
        while found := self._messages.receive():
            kind, body = found
            if kind in _FAILURES:
                raise RefusedError(body[8:].decode("utf-8", "replace"))
            if kind == _OPENED:
                return
        raise lost(self._host)

    def _without_status(self) -> int:
        """The session has ended: by a signal if the connection is there still. Raises ``HostError``."""
        if not _is_alive(self._control):
            raise lost(self._host)
        return _KILLED


class _Messages:
    """Messages to and from the ``ssh`` that has the connection."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_UNIX)
        self._received = b""

    def connect(self, control: Path, timeout: float) -> None:
        """Raises ``OSError``."""
        self.socket.settimeout(timeout)
        self.socket.connect(str(control))
        self._send(struct.pack(">II", _HELLO, _VERSION))

    def send(self, kind: int, body: bytes = b"") -> None:
        """Sends a request."""
        self._send(struct.pack(">II", kind, _REQUEST) + body)

    def receive(self) -> tuple[int, bytes] | None:
        """The next message; None at the end. Raises ``BlockingIOError`` where none is there yet."""
        while True:
            size = struct.unpack(">I", self._received[:4])[0] if len(self._received) >= 4 else 0
            if size > _LONGEST:
                return None
            if len(self._received) >= 4 + max(size, 4):
                message, self._received = self._received[4 : 4 + size], self._received[4 + size :]
                return struct.unpack(">I", message[:4])[0], message[4:]
            piece = self.socket.recv(1 << 12)
            if not piece:
                return None
            self._received += piece

    def _send(self, body: bytes) -> None:
        self.socket.sendall(struct.pack(">I", len(body)) + body)


def _is_alive(control: Path) -> bool:
    """True if the ``ssh`` that has the connection answers; one that ends does not."""
    line = _Messages()
    with suppress(OSError), line.socket:
        line.connect(control, _ALIVE)
        line.send(_ALIVE_CHECK)
        while found := line.receive():
            if found[0] == _IS_ALIVE:
                return True
    return False


def _text(text: str) -> bytes:
    raw = text.encode()
    return struct.pack(">I", len(raw)) + raw
