"""The arguments of a program without those of ROS."""

from __future__ import annotations

from typing import Sequence


def own_arguments(arguments: Sequence[str]) -> list[str]:
    """Returns the arguments without `name:=value` of ROS 1, and without what follows --ros-args of ROS 2."""
    before = list(arguments)
    if "--ros-args" in before:
        before = before[: before.index("--ros-args")]
    return [one for one in before if ":=" not in one]
