"""Finds the operator's catkin workspace, with every folder that its build refers to."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from swarmctl.lab.errors import LabError
from swarmctl.lab.lab_plan import Workspace

_SPACES = ("devel", "install")
_PATH = re.compile(r"[A-Za-z0-9._/+-]+")
_BUILT_ON = re.compile(r"^ *CMAKE_PREFIX_PATH = r'([^']*)'", re.MULTILINE)  # in a space's _setup_util.py
_ROS = "/opt/ros/"
_OF_THE_HOST = (_ROS, "/usr")  # every host has its own ROS


def installed(distro: str) -> str:
    """Returns where hosts look for ROS if their swarm has no workspace."""
    return f"{_ROS}{distro}"


def workspace_of(given: Path, place: str) -> Workspace:
    """Returns the workspace in ``given`` (or the devel or install space ``given``), for hosts to use at
    ``place``.

    Raises ``LabError`` if it is missing, not built or has a path that ROS cannot use.
    """
    top = given.resolve()
    if not top.is_dir():
        raise LabError(f"there is no workspace {given}", "give the folder that contains `src` and `devel`")
    space = next(
        (one for one in (*(top / name for name in _SPACES), top) if (one / "setup.sh").is_file()), None
    )
    if space is None:
        built = (
            "build it first (`catkin_make` there)" if (top / "src").is_dir() else "give a catkin workspace"
        )
        raise LabError(f"{given} has no devel/setup.sh, no install/setup.sh and no setup.sh", built)
    folders = tuple(
        dict.fromkeys(str(one) for one in (top, *_beside(space)) if one == top or top not in one.parents)
    )
    if strange := [one for one in folders if not _PATH.fullmatch(one)]:
        raise LabError(f"the path {strange[0]} has characters that ROS cannot use", "move the workspace")
    return Workspace(str(space), place, folders)


def _beside(space: Path) -> Iterator[Path]:
    """Yields other folders that a space needs: its sources (devel), and the workspaces it was built on."""
    marker, built = space / ".catkin", space / "_setup_util.py"
    named = marker.read_text().strip().split(";") if marker.is_file() else []
    base = _BUILT_ON.search(built.read_text()) if built.is_file() else None
    for path in [*named, *(base[1].split(";") if base else ())]:
        if path and not path.startswith(_OF_THE_HOST) and Path(path).is_dir():
            yield Path(path)
