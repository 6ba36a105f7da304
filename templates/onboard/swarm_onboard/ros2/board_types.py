"""Message types of ROS 2 as ROS 1 knows them: MD5 sums, and the size of the smallest message."""

from __future__ import annotations

import os
import re
from functools import lru_cache
from hashlib import md5
from pathlib import Path
from typing import Any, Iterator

from swarm_onboard.ros2 import ros1_bytes

_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}
_HEADER, _HEADER_MD5 = "std_msgs/Header", "2176decaecbce78abc3b96ef049fabed"  # of ROS 1, with its `seq`
#: Sums of definitions that have other names, constants or fields than in ROS 1, and what they are there.
_CHANGED = {
    "79e1dc841cdbf5f4ff851848b368746b": "4ddae7f048e32fda22cac764685e3974",  # BatteryState: constants
    "b5aff04250fbf270b71bef9d82c2132e": "c9a58c1b0b154e0e6da7578cb991d214",  # CameraInfo: d, k, r, p
    "23ac1cfdf2364e1754b785804f19f800": "331cdbddfa4bc96ffc3b9ad98900a54c",  # NavSatStatus: constants
    "470cee326c156c680917c830889c04a6": "c005c34273dc426c67a020a87bc24148",  # Range: variance
}
_LINE = re.compile(
    r"(?P<type>[A-Za-z0-9_/]+)(?P<array>\[[^]]*\])?\s+(?P<name>[A-Za-z0-9_]+)\s*(=\s*(?P<value>.*))?"
)


@lru_cache(maxsize=64)
def md5sum_and_least(name: str) -> tuple[str, int] | None:
    """Returns the MD5 sum and the size of the smallest message of a type; None if this host has no such type.

    A type whose definition has changed since ROS 1 in a way that is not known here has another sum: a sketch
    cannot use it.
    """
    if not _TYPE.fullmatch(name):
        return None
    try:
        return _md5sum(name), len(ros1_bytes.encode(ros1_bytes.message_class(name)()))
    except Exception:  # noqa: BLE001  whatever is wrong with a package, it has no such type for us
        return None


def message_class(name: str) -> Any:
    """Returns the class of a message type; None if this host has none."""
    try:
        return ros1_bytes.message_class(name)
    except Exception:  # noqa: BLE001  whatever is wrong with a package, it has no such type for us
        return None


def _md5sum(name: str) -> str:
    """The sum as ROS 1 computes it from a definition (wiki.ros.org/ROS/Technical Overview)."""
    if name == _HEADER:
        return _HEADER_MD5
    package, _, kind = name.partition("/")
    definition = share(package).joinpath("msg", f"{kind}.msg").read_text("utf-8")
    found = md5("\n".join(_md5_lines(definition, package)).encode("utf-8")).hexdigest()
    return _CHANGED.get(found, found)


def _md5_lines(definition: str, package: str) -> Iterator[str]:
    """The constants, then the fields, with the sums of their types in place of the types' names."""
    lines = [line.partition("#")[0].strip() for line in definition.splitlines()]
    found = [_LINE.match(line) for line in lines if line]
    parts = [one for one in found if one is not None]
    yield from (f"{one['type']} {one['name']}={one['value'].strip()}" for one in parts if one["value"])
    for one in parts:
        if not one["value"]:
            kind = _TIMES.get(one["type"], one["type"])
            if kind[:1].isupper() or "/" in kind:
                yield f"{_md5sum(kind if '/' in kind else f'{package}/{kind}')} {one['name']}"
            else:
                yield f"{kind}{one['array'] or ''} {one['name']}"


def share(package: str) -> Path:
    """Returns the folder of a package in the spaces of this process. Raises FileNotFoundError."""
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        folder = Path(prefix, "share", package)
        if prefix and folder.is_dir():
            return folder
    raise FileNotFoundError(package)
