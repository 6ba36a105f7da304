"""The ROS variables of shell scripts and environment files, as far as they are written out."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping

from swarmctl.importing.draft import Value
from swarmctl.ros_packages.launched import Place

_VARIABLES = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")
_BEFORE = {"export", "then", "else", "do", "{"}  # words before an assignment
_ASSIGNMENT = re.compile(r"(\w+)=(.*)", re.DOTALL)
_COMPUTED = re.compile(r"[$`{}*\\]")


def is_env_file(text: str) -> bool:
    """Returns True if a script sets a variable that says which master or address ROS uses."""
    return any(any(_assignments(line)) for line in text.splitlines())


def env_of(path: str, text: str) -> tuple[Mapping[str, Value], list[str]]:
    """Returns the ROS variables of a script, and why others are not known."""
    found: dict[str, Value] = {}
    unread: dict[str, str] = {}
    for number, line in enumerate(text.split("\n"), 1):
        for name, value in _assignments(line):
            place, before = Place(path, number), found.pop(name, None)
            if _COMPUTED.search(value):
                unread[name] = f"{place}: {name} is computed by the shell"
            elif name in unread or (before is not None and before.value != value):
                unread[name] = f"{place}: {name} is set more than once in this file"
            elif value:
                found[name] = Value(value, place)
    return found, list(unread.values())


def _assignments(line: str) -> Iterator[tuple[str, str]]:
    """The ROS variables that a line sets, alone or with others: not those of an `echo`."""
    if not any(name in line for name in _VARIABLES):
        return
    words = shlex.shlex(line, posix=True, punctuation_chars=";&|")
    words.whitespace_split = True
    is_start = True
    try:
        for word in words:
            assignment = _ASSIGNMENT.fullmatch(word) if is_start else None
            if assignment and assignment[1] in _VARIABLES:
                yield assignment[1], assignment[2]
            is_start = bool(assignment) or word in _BEFORE or not word.strip(";&|")
    except ValueError:  # a quote that another line closes
        return
