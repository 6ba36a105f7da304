"""The ROS variables of shell scripts and environment files, as far as they are written out."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

from swarmctl.importing.draft import Unread
from swarmctl.ros_packages.launched import Place

OWN = frozenset({"localhost", "127.0.0.1", "127.0.1.1", "::1"})  # what each computer calls itself
VARIABLES = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")
_ASSIGNMENT = re.compile(rf"\s*(?:export\s+)?({'|'.join(VARIABLES)})=(.*)")
_QUOTED = re.compile(r"\s*(?:\"([^\"]*)\"|'([^']*)'|([^\s;#]*))\s*(?:[;#].*)?")
_COMPUTED = re.compile(r"[$`{}*()\\]")


@dataclass(frozen=True)
class Written:
    """The value of a variable, and where it stands."""

    value: str
    place: Place


def is_env_file(text: str) -> bool:
    """Returns True if a script sets a variable that says which master or address ROS uses."""
    return any(_ASSIGNMENT.match(line) for line in text.splitlines())


def env_of(path: str, text: str) -> tuple[Mapping[str, Written], tuple[Unread, ...]]:
    """Returns the ROS variables of a script, and those that a shell would compute."""
    found: dict[str, Written] = {}
    unread: dict[str, Unread] = {}
    for number, line in enumerate(text.split("\n"), 1):
        if (match := _ASSIGNMENT.match(line)) is None:
            continue
        name, place = match[1], Place(path, number)
        value = _QUOTED.fullmatch(match[2])
        plain = "" if value is None else value[1] or value[2] or value[3] or ""
        before = found.pop(name, None)
        if value is None or _COMPUTED.search(plain):
            unread[name] = Unread(place, f"{name} is computed by the shell")
        elif name in unread or (before is not None and before.value != plain):
            unread[name] = Unread(place, f"{name} is set more than once in this file")
        elif plain:
            found[name] = Written(plain, place)
    return found, tuple(unread.values())


def master_of(uri: str) -> tuple[str, int] | None:
    """Returns the host and the port of a ROS_MASTER_URI; None for what is none."""
    try:
        parts = urlsplit(uri)
        return (parts.hostname, parts.port or 11311) if parts.hostname else None
    except ValueError:
        return None


def is_ip(address: str) -> bool:
    """Returns True for an IP address, False for a name."""
    try:
        ipaddress.ip_address(address)
    except ValueError:
        return False
    return True
