"""The ROS variables of shell scripts and environment files, as far as they are written out."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

from swarmctl.importing.draft import Unread
from swarmctl.ros_packages.launched import Place

OWN = frozenset({"localhost", "127.0.0.1", "127.0.1.1", "::1"})  # what each computer calls itself
VARIABLES = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")
_WORD = r"(?:\"[^\"]*\"|'[^']*'|[^\s;&#\"'])*(?:[\"'].*)?"
_ASSIGNMENTS = re.compile(rf"(?:^|;|&&)\s*(?:export\s)?((?:\s*\w+={_WORD})+)")
_ASSIGNMENT = re.compile(rf"({'|'.join(VARIABLES)})=({_WORD})")
_QUOTED = re.compile(r"\"([^\"]*)\"|'([^']*)'|([^\"']*)")
_COMPUTED = re.compile(r"[$`{}*()\\]")


@dataclass(frozen=True)
class Written:
    """The value of a variable, and where it stands."""

    value: str
    place: Place


def is_env_file(text: str) -> bool:
    """Returns True if a script sets a variable that says which master or address ROS uses."""
    return any(any(_assignments(line)) for line in text.splitlines())


def env_of(path: str, text: str) -> tuple[Mapping[str, Written], tuple[Unread, ...], tuple[str, ...]]:
    """Returns the ROS variables of a script, those that a shell would compute, and what was corrected."""
    found: dict[str, Written] = {}
    unread: dict[str, Unread] = {}
    corrected: list[str] = []
    for number, line in enumerate(text.split("\n"), 1):
        for name, word in _assignments(line):
            place, value = Place(path, number), _QUOTED.fullmatch(word)
            plain = "" if value is None else value[1] or value[2] or value[3] or ""
            meant, before = _corrected(name, plain), found.pop(name, None)
            if value is None or _COMPUTED.search(plain):
                unread[name] = Unread(place, f"{name} is computed by the shell")
            elif name in unread or (before is not None and before.value != meant):
                unread[name] = Unread(place, f"{name} is set more than once in this file")
            elif plain:
                found[name] = Written(meant, place)
                if meant != plain:
                    needed = "http://HOST:PORT" if name == "ROS_MASTER_URI" else "a name or an IP address"
                    corrected.append(f"{place}: {name} is read as `{meant}`; ROS needs {needed}")
    return found, tuple(unread.values()), tuple(corrected)


def _corrected(name: str, value: str) -> str:
    """What a URI without its scheme, or one in the place of an address, is meant to be."""
    master, is_uri = master_of(value), "://" in value
    if master is None or is_uri is (name == "ROS_MASTER_URI"):
        return value
    return master[0] if is_uri else f"http://{master[0]}:{master[1]}"


def _assignments(line: str) -> Iterator[tuple[str, str]]:
    """The ROS variables that a line sets, each with its word as it is written."""
    for command in _ASSIGNMENTS.finditer(line):
        yield from _ASSIGNMENT.findall(command[1])


def master_of(uri: str) -> tuple[str, int] | None:
    """Returns the host and the port of a ROS_MASTER_URI, also without `http://`; None for what is none."""
    try:
        parts = urlsplit(uri if "://" in uri else f"http://{uri}")
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
