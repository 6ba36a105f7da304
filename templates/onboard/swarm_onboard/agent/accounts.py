"""The account that a swarm's operators log in as: whether it exists, its keys, its sudo rule, its groups."""

from __future__ import annotations

import os
import re

from . import command, files
from .errors import FailedError, RefusedError
from .named_tuple import NamedTuple

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterable

    Outside = Callable[[str], str]

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]{0,31}")  # as in a spec
_RULE = re.compile(r"\(ALL(?: : ALL)?\) NOPASSWD: ALL")
_TIMEOUT = 60.0  # s
_KEYS = ".ssh/authorized_keys"


class AccountState(NamedTuple):
    """``exists``; ``keys``: some key logs in to it; ``sudo``: runs all without a password; its ``groups``."""

    exists: bool
    keys: bool
    sudo: bool
    groups: list[str]


def state(name: str, outside: Outside) -> AccountState:
    """Returns the account as the host's own databases have it."""
    home = _home(_checked(name))
    if home is None:
        return AccountState(False, False, False, [])
    rules = "" if name == "root" else command.output_of(["sudo", "-n", "-l", "-U", name])
    return AccountState(
        True,
        keys=bool((files.read(outside(f"{home}/{_KEYS}")) or b"").strip()),
        sudo=name == "root" or _RULE.search(rules) is not None,
        groups=command.output_of(["id", "-nG", name]).split(),
    )


def existing(groups: Iterable[str]) -> list[str]:
    """Returns those groups that exist on the host."""
    names = [_checked(group) for group in groups]
    return [name for name in names if command.output_of(["getent", "group", name])]


def create(name: str) -> None:
    """Creates the account with a home of its own and no password. Raises ``FailedError``."""
    argv = ["useradd", "--create-home", "--shell", "/bin/bash", _checked(name)]
    command.run(argv, f"useradd {name}", timeout=_TIMEOUT)


def copy_keys(name: str, login: str, outside: Outside) -> None:
    """Lets the keys that log in as ``login`` log in as ``name`` too. Raises ``FailedError``."""
    source, home = _home(_checked(login)), _home(_checked(name))
    keys = (files.read(outside(f"{source}/{_KEYS}")) or b"").strip()
    if source is None or home is None or not keys:
        raise FailedError(
            f"{login} has no keys in ~/{_KEYS} that {name} could take over",
            f"copy one to the host: `ssh-copy-id {name}@...`",
        )
    place = outside(f"{home}/{_KEYS}")
    owner = os.stat(outside(home))
    folder = os.path.dirname(place)
    os.makedirs(folder, 0o700, exist_ok=True)
    before = files.read(place) or b""
    new = [line for line in keys.splitlines() if line not in before.splitlines()]
    text = (before.rstrip() + b"\n" if before.strip() else b"") + b"\n".join(new) + b"\n"
    files.replace(place, text, mode=0o600)
    for path in (folder, place):
        os.chown(path, owner.st_uid, owner.st_gid)


def allow_sudo(name: str, outside: Outside) -> None:
    """Lets the account run everything as root without a password. Raises ``FailedError``."""
    place = outside(
        "/etc/sudoers.d/90-swarm-" + _checked(name).replace(".", "-")
    )  # sudo skips names with dots
    draft = place + "~"  # sudo ignores names that end so
    files.replace(draft, f"{name} ALL=(ALL) NOPASSWD: ALL\n".encode("ascii"), mode=0o440)
    try:
        command.run(["visudo", "-c", "-f", draft], "the check of the sudo rule", timeout=_TIMEOUT)
        os.rename(draft, place)
    finally:
        files.remove(draft)


def join(name: str, group: str) -> None:
    """Makes the account a member of the group, which is created if need be. Raises ``FailedError``."""
    command.run(["groupadd", "--system", "--force", _checked(group)], f"groupadd {group}", timeout=_TIMEOUT)
    if _checked(name) != "root":
        command.run(["usermod", "-aG", group, name], f"usermod -aG {group} {name}", timeout=_TIMEOUT)


def _home(name: str) -> str | None:
    entry = command.output_of(["getent", "passwd", name]).strip().split(":")
    return entry[5] if len(entry) > 6 else None


def _checked(name: str) -> str:
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise RefusedError(f"{name!r} is not a name of an account or group")
    return name
