"""A catkin workspace of the operator's own, for every host of a lab: found, and found whole."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from swarmctl.lab.errors import LabError
from swarmctl.lab.plan import Workspace

_SPACES = ("devel", "install")
_PATH = re.compile(r"[A-Za-z0-9._/+-]+")
_BUILT_UPON = re.compile(r"^ *CMAKE_PREFIX_PATH = r'([^']*)'", re.MULTILINE)  # in a space's _setup_util.py
_OF_THE_HOST = ("/opt/ros/", "/usr")  # ROS itself is what each host has


def workspace_of(given: Path, place: str) -> Workspace:
    """The workspace in ``given``, or the space that ``given`` is, to be met by the hosts at ``place``."""
    top = given.resolve()
    if not top.is_dir():
        raise LabError(f"there is no workspace {given}", "give the folder that holds its `src` and `devel`")
    space = next(
        (one for one in (*(top / name for name in _SPACES), top) if (one / "setup.sh").is_file()), None
    )
    if space is None:
        built = (
            "build it first (`catkin_make` there)" if (top / "src").is_dir() else "give a catkin workspace"
        )
        raise LabError(f"{given} holds no devel/setup.sh, no install/setup.sh and no setup.sh", built)
    folders = tuple(
        dict.fromkeys(str(one) for one in (top, *_beside(space)) if one == top or top not in one.parents)
    )
    if strange := [one for one in folders if not _PATH.fullmatch(one)]:
        raise LabError(
            f"the path {strange[0]} has characters that no ROS path can have", "move the workspace"
        )
    return Workspace(str(space), place, folders)


def _beside(space: Path) -> Iterator[Path]:
    """What a space needs elsewhere: a devel space its sources; and the workspaces it was built upon."""
    marker, built = space / ".catkin", space / "_setup_util.py"
    named = marker.read_text().strip().split(";") if marker.is_file() else []
    upon = _BUILT_UPON.search(built.read_text()) if built.is_file() else None
    for path in [*named, *(upon[1].split(";") if upon else ())]:
        if path and not path.startswith(_OF_THE_HOST) and Path(path).is_dir():
            yield Path(path)
