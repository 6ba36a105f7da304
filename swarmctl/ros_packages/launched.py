"""What a launch file starts and sets, and what roslaunch refuses in it: values."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum


@dataclass(frozen=True, order=True)
class Place:
    """A line of a file of a package. ``file`` is the path that messages show."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.file


class Refusal(str, Enum):
    """Why roslaunch stops, or skips a part of the file."""

    UNUSED = "an argument that is given and not declared"
    MISSING = "an argument that has no value"
    FIXED = "an argument that is given, and that the file sets itself"
    BROKEN = "a file that roslaunch cannot read"
    SKIPPED = "an element that roslaunch does not know, and skips"
    ABSENT = "a file of a package that does not exist"


@dataclass(frozen=True)
class Fault:
    """One refusal. ``subject`` is the argument or the path, ``known`` are those that exist."""

    kind: Refusal
    subject: str
    place: Place
    text: str = ""
    known: tuple[str, ...] = ()


@dataclass(frozen=True)
class Setting:
    """A parameter or an environment variable; None for a value that only the host knows."""

    name: str
    value: str | None
    place: Place
    type: str = ""  # that a parameter declares


@dataclass(frozen=True)
class Rosparam:
    """A <rosparam>: ``name`` is empty if its text has the names; None for what only the host knows."""

    name: str | None
    text: str | None
    place: Place


@dataclass(frozen=True)
class Node:
    """A node that a launch file starts; None for a name that only the host knows."""

    name: str | None  # with its namespace
    package: str | None
    executable: str | None
    remaps: tuple[tuple[str, str], ...]
    place: Place
    certain: bool  # False below an `if` whose value only the host knows
    machine: str | None = ""
    arguments: str | None = ""
    parameters: tuple[Setting, ...] = ()  # its private ones
    environment: tuple[Setting, ...] = ()
    rosparams: tuple[Rosparam, ...] = ()


@dataclass(frozen=True)
class Machine:
    """A computer on which roslaunch starts nodes over SSH; None for a value that only the host knows."""

    name: str | None
    address: str | None
    user: str | None
    port: str | None
    place: Place
    is_default: bool  # for nodes that name no machine
    has_password: bool
    certain: bool  # as of a node


@dataclass
class Launched:
    """All that one launch file and its includes bring."""

    arguments: dict[str, str | None] = field(default_factory=dict)  # that the file itself declares
    nodes: list[Node] = field(default_factory=list)
    parameters: list[Setting] = field(default_factory=list)
    environment: list[Setting] = field(default_factory=list)
    rosparams: list[Rosparam] = field(default_factory=list)
    machines: list[Machine] = field(default_factory=list)
    masters: list[Place] = field(default_factory=list)
    packages: dict[str, Place] = field(default_factory=dict)  # that it names, with the first place
    files: dict[str, None] = field(default_factory=dict)  # it and its includes, as messages show them
    unfound: list[Place] = field(default_factory=list)  # includes whose file is not known here
    unknown: dict[tuple[Place, str], str] = field(default_factory=dict)
    """The substitution on which an attribute depends; `if` is also `unless`, and that of what is around."""
    faults: list[Fault] = field(default_factory=list)
    cost: int = 0
