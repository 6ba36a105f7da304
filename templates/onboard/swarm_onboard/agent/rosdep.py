"""Looks keys of package.xml files up with the host's own rosdep, if it has one."""

from __future__ import annotations

import re
import shutil

from . import command, debian

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Sequence

_TIMEOUT = 60.0  # s; it reads all its lists
_KEY = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,100}")


def resolved(keys: Sequence[str], distro: str, account: str) -> dict[str, list[str]]:
    """Returns the Debian packages of each key that rosdep knows; none without rosdep, or without its lists.

    The lists are those that ``account`` has fetched by ``rosdep update``.
    """
    wanted = [key for key in keys if _KEY.fullmatch(key)]
    if not wanted or not _KEY.fullmatch(distro) or shutil.which("rosdep") is None:
        return {}
    argv = ["rosdep", "resolve", "--rosdistro", distro, *wanted]
    as_account = argv if account == "root" else ["runuser", "--login", account, "-c", " ".join(argv)]
    return parsed(command.output_of(as_account, _TIMEOUT))


def parsed(output: str) -> dict[str, list[str]]:
    """Returns the Debian packages by key in the output of ``rosdep resolve``."""
    found: dict[str, list[str]] = {}
    key, installer = "", ""
    for line in output.splitlines():
        if line.startswith("#ROSDEP["):
            key, installer = line[len("#ROSDEP[") :].rstrip("] "), ""
        elif line.startswith("#"):
            installer = line[1:].strip()
            if installer == "apt" and key:
                found[key] = []
        elif installer == "apt" and key:
            found[key] += [name for name in line.split() if debian.NAME.fullmatch(name)]
    return found
