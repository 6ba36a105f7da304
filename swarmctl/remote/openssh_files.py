"""What OpenSSH's configuration and known_hosts files share: how they are read, and their host patterns."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

_MAX_BYTES = 1 << 20


class OpenSshFileError(Exception):
    """A file cannot be read; the message starts with the file and, where known, the line."""


def read_text(path: Path) -> str:
    """The text of a file; bytes that are not UTF-8 become surrogates. Raises ``OpenSshFileError``."""
    if not path.is_file():  # a pipe would block
        raise OpenSshFileError(f"{path}: not a regular file")
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_BYTES + 1)
    except OSError as error:
        raise OpenSshFileError(f"{path}: cannot be read: {error.strerror}") from error
    if len(content) > _MAX_BYTES:
        raise OpenSshFileError(f"{path}: larger than {_MAX_BYTES >> 20} MiB")
    return content.decode("utf-8", errors="surrogateescape")


def matches(patterns: Sequence[str], names: Sequence[str]) -> bool:
    """OpenSSH's rule: one pattern matches, and none that begins with ``!`` does. Brackets mean themselves."""

    def fits(pattern: str) -> bool:
        return any(fnmatchcase(name, pattern.replace("[", "[[]")) for name in names)

    excluded = any(fits(pattern[1:]) for pattern in patterns if pattern.startswith("!"))
    return not excluded and any(fits(pattern) for pattern in patterns)
