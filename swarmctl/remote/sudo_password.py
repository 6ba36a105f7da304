"""The password that ``sudo`` of hosts asks for: kept in memory, sent on standard input, written nowhere."""

from __future__ import annotations

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


def from_file(path: Path) -> SudoPassword:
    """The first line of a file, a pipe or ``/dev/fd/N``. Raises ``OSError`` or ``ValueError``."""
    with path.open("rb") as file:
        first, _, _ = file.read(_MOST + 2).decode("utf-8").partition("\n")
    return SudoPassword(first.removesuffix("\r"))
