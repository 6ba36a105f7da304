"""What the units of a host need to start: programs, Python modules, ROS packages and workspaces."""

from __future__ import annotations

import os

from . import packages, platforms, preflight

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterable

_LOCAL = "/usr/local/lib"


def found(requires: Iterable[str], outside: Callable[[str], str]) -> dict[str, str | None]:
    """Returns where each requirement is, or None. ``outside`` returns where a path of the host is read."""
    wanted = list(requires)
    modules = _modules("rospy", "serial", "tf2_msgs")
    return {
        **preflight.found(wanted, outside),
        "roscore": _roscore(),
        "rospy": modules["rospy"],
        "pyserial": modules["serial"],
        "tf2_msgs": modules["tf2_msgs"],
        **packages.found(wanted, outside),
    }


def _roscore() -> str | None:
    of_ros = (f"{platforms.ROS}/{one}/bin" for one in platforms.distributions(str))
    places = (f"{folder}/roscore" for folder in (*os.get_exec_path(), *of_ros))
    return next((place for place in places if os.access(place, os.X_OK)), None)


def _modules(*names: str) -> dict[str, str | None]:
    """Where each Python module lies that a driver may import."""
    local = sorted(os.listdir(_LOCAL)) if os.path.isdir(_LOCAL) else []
    folders = [
        *(f"{platforms.ROS}/{one}/lib/python3/dist-packages" for one in platforms.distributions(str)),
        "/usr/lib/python3/dist-packages",
        *(f"{_LOCAL}/{one}/dist-packages" for one in local if one.startswith("python3")),
    ]
    return {
        name: next((f"{folder}/{name}" for folder in folders if os.path.exists(f"{folder}/{name}")), None)
        for name in names
    }
