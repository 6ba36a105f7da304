"""Debian packages: which are installed, which could be, and their installation by apt."""

from __future__ import annotations

import re

from . import command
from .errors import RefusedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterable, Literal, Sequence

    DebianState = Literal["installed", "available", "unknown"]

NAME = re.compile(r"[a-z0-9][a-z0-9.+-]{1,100}")
_UPDATING, _INSTALLING = 600.0, 3600.0  # s
_LOCK = ("-o", "DPkg::Lock::Timeout=120")  # s to wait for another apt, such as the daily one
_WORTH_A_NOTE = re.compile(r"(Setting up|Unpacking) (\S+)")
_CANDIDATE = re.compile(r"^  (Installed|Candidate): (.*)$")


def states(names: Iterable[str]) -> dict[str, DebianState]:
    """Returns for each name whether it is installed, available from a package source, or unknown to apt."""
    wanted = [name for name in names if NAME.fullmatch(name)]
    found: dict[str, DebianState] = dict.fromkeys(wanted, "unknown")
    if not wanted:
        return found
    package = ""
    for line in command.output_of(["apt-cache", "policy", *wanted]).splitlines():
        match = _CANDIDATE.match(line)
        if match is None:
            package = line[:-1] if line.endswith(":") and not line.startswith(" ") else package
        elif package in found and match.group(2) != "(none)" and found[package] != "installed":
            found[package] = "installed" if match.group(1) == "Installed" else "available"
    return found


def refresh(note: Callable[[str], None]) -> None:
    """Reads the lists of all package sources anew. Raises ``FailedError``."""
    note("apt-get update")
    command.run(["apt-get", *_LOCK, "update"], "apt-get update", timeout=_UPDATING)


def install(names: Sequence[str], note: Callable[[str], None]) -> None:
    """Installs the packages; keeps changed settings. Raises ``RefusedError`` and ``FailedError``."""
    for name in names:
        if not NAME.fullmatch(name):
            raise RefusedError(f"{name!r} is not a name of a Debian package")

    def progress(line: str) -> None:
        match = _WORTH_A_NOTE.match(line)
        if match is not None:
            note(f"{match.group(1).lower()} {match.group(2)}")

    options = (*_LOCK, "-o", "Dpkg::Options::=--force-confdef", "-o", "Dpkg::Options::=--force-confold")
    argv = ["apt-get", *options, "install", "-y", "--no-install-recommends", "--", *names]
    command.run(argv, f"apt-get install {' '.join(names)}", timeout=_INSTALLING, line=progress)
