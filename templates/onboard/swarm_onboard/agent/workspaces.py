"""Catkin workspaces of the host: whether they are built, and their build."""

from __future__ import annotations

import os
import pwd

from . import catkin, packages
from .errors import RefusedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Literal, Sequence

    WorkspaceState = Literal["built", "sources", "absent"]


def state(path: str, outside: Callable[[str], str]) -> WorkspaceState:
    """Returns whether the workspace is built, has sources only, or is absent."""
    if packages.space(path, outside):
        return "built"
    return "sources" if os.path.isdir(outside(f"{path}/src")) else "absent"


def build_in_order(
    paths: Sequence[str], known: Sequence[str], outside: Callable[[str], str], note: Callable[[str], None]
) -> None:
    """Builds those ``paths`` of the ``known`` workspaces, the last one first: each upon those behind it.

    Raises ``RefusedError`` and ``FailedError``.
    """
    for number in reversed(range(len(known))):
        if known[number] in paths:
            build(known[number], known[number + 1 :], outside, note)


def build(
    path: str, behind: Sequence[str], outside: Callable[[str], str], note: Callable[[str], None]
) -> None:
    """Builds the workspace as its owner, upon those ``behind`` it.

    Raises ``RefusedError`` and ``FailedError``.
    """
    source = outside(f"{path}/src")
    if not os.path.isabs(path) or not os.path.isdir(source):
        raise RefusedError(f"{path} has no folder src", "copy the workspace to the host")
    catkin.run(
        ["catkin_make", "-C", outside(path), f"-j{catkin.jobs()}"],
        f"catkin_make in {path}",
        owner=pwd.getpwuid(os.stat(source).st_uid),
        setups=catkin.setup_files(behind, outside),
        log=outside(f"{path}/catkin_make.log"),
        note=lambda text: note(f"{path}: {text}"),
    )
