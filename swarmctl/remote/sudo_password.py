"""The password that ``sudo`` of hosts asks for: kept in memory, sent on standard input, written nowhere."""

from __future__ import annotations

import errno
import os
import select
import time
from pathlib import Path

_MOST = 1024  # bytes


class SudoPassword:
    """One password for the accounts of all hosts. A host that rejected it does not get it again.

    Hosts lock an account after a few wrong ones.
    """

    def __init__(self, password: str) -> None:
        """Raises ``ValueError`` if it is empty or more than one line."""
        if not password or len(password.encode()) > _MOST or set(password) & set("\n\r\0"):
            raise ValueError("a password is one line, not empty")
        self._password = password
        self._rejected: set[str] = set()

    def __repr__(self) -> str:
        return "SudoPassword()"

    def of(self, host: str) -> bytes | None:
        """The password as a line; None for a host that rejected it."""
        return None if host in self._rejected else self._password.encode() + b"\n"

    def rejected_by(self, host: str) -> None:
        """Notes that this host did not accept it."""
        self._rejected.add(host)


def from_file(path: Path, patience: float) -> SudoPassword:
    """The first line of a file, a pipe or ``/dev/fd/N``; ``patience``: s that a pipe has to give it.

    Raises ``OSError`` or ``ValueError``.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    try:
        first = _first_line(descriptor, time.monotonic() + patience)
    finally:
        os.close(descriptor)
    return SudoPassword(first.decode("utf-8").removesuffix("\r"))


def _first_line(descriptor: int, deadline: float) -> bytes:
    read = b""
    while b"\n" not in read and len(read) <= _MOST + 1:
        ready, _, _ = select.select([descriptor], [], [], max(0.0, deadline - time.monotonic()))
        if not ready:
            raise TimeoutError(errno.ETIMEDOUT, "nobody writes to this pipe")
        more = os.read(descriptor, _MOST + 2)
        if not more:
            break
        read += more
    return read.partition(b"\n")[0]
