"""A draft of a spec as values: each has its place in the lab's files, or the reason why it is a guess."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

from swarmctl.ros_packages.launched import Place
from swarmctl.swarm.names import LONGEST_NAME, valid_name
from swarmctl.yamltext.emit import literal

GUESS = "guess: "
FILL_IN = "fill in: "


@dataclass(frozen=True)
class Value:
    """A value that stands at ``place`` of a file or, with a reason in ``guess``, is derived from others.

    ``was`` is what the file has, where it had to be converted, and ``needed`` what ROS needs there. If no
    file has the value, ``fill_in`` says what to write, and ``value`` is an example.
    """

    value: Any
    place: Place | None = None
    guess: str = ""
    was: str = ""
    fill_in: str = ""
    needed: str = ""

    @property
    def source(self) -> str:
        """Where it is from, as a comment says it; empty for an example."""
        if self.fill_in:
            return ""
        was = f"{literal(self.was, chr(34))} there" if self.was else ""
        was = ", ".join(one for one in (was, f"ROS needs {self.needed}" if self.needed else "") if one)
        if not self.guess:
            return ", ".join(one for one in (f"from {self.place}" if self.place else "", was) if one)
        there = ", ".join(one for one in (str(self.place or ""), was) if one)
        return f"{GUESS}{self.guess}{f' ({there})' if there else ''}; check"

    @property
    def todo(self) -> str:
        """What is to fill in, as a comment says it; empty if it is known."""
        return f"{FILL_IN}{self.fill_in}" if self.fill_in else ""


@dataclass
class Entry:
    """A host, a robot or a program."""

    name: Value
    fields: dict[str, Value] = field(default_factory=dict)


@dataclass
class Draft:
    """A spec to be. A reader of files adds what it finds."""

    source: str
    name: Value = Value("lab", guess="no file names the whole")
    first: dict[str, Value] = field(default_factory=dict)  # above the hosts
    hosts: dict[str, Entry] = field(default_factory=dict)
    robots: dict[str, Entry] = field(default_factory=dict)
    networks: list[Value] = field(default_factory=list)
    lines: list[Value] = field(default_factory=list)  # between robots and their hosts
    programs: dict[str, Entry] = field(default_factory=dict)
    multimaster: dict[str, Value] = field(default_factory=dict)
    patterns: dict[str, Value] = field(default_factory=dict)  # keys of `multimaster`, to fill in
    last: dict[str, Value] = field(default_factory=dict)  # below the programs
    masters: dict[str, Value] = field(default_factory=dict)  # the host of each host's master
    unread: list[str] = field(default_factory=list)  # places that are not in the draft, and why


def named(text: str, prefix: str, place: Place | None, taken: Collection[str], guess: str = "") -> Value:
    """Returns a name of the spec for what a file calls ``text``; one that is ``taken`` gets a number."""
    name = valid_name(text, prefix)
    found, count = name, 1
    while found in taken:
        count += 1
        found = f"{name[: LONGEST_NAME - len(str(count)) - 1]}-{count}"
    return Value(found, place, guess, was=text if found != text else "")
