"""An Ansible inventory as values: its hosts, its groups and their variables, each with its line."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from swarmctl.importing.draft import Unread
from swarmctl.ros_packages.launched import Place

MAX_HOSTS = 2_000
_MAX_GROUPS = 300
_MAX_VALUES = 100_000  # of variables of hosts, with those of their groups
COMPUTED = re.compile(r"\{[{%#]")  # of Jinja
_RANGE = re.compile(r"\[([0-9]+|[A-Za-z]):([0-9]+|[A-Za-z])(?::([0-9]{1,6}))?\]", re.ASCII)


@dataclass(frozen=True)
class Variable:
    """The value of a variable as text; ``is_vault`` if it is encrypted, ``is_nested`` if it is no scalar."""

    value: str
    place: Place
    is_vault: bool = False
    is_nested: bool = False


Variables = dict[str, Variable]


@dataclass
class Group:
    """A group of hosts."""

    hosts: dict[str, Place] = field(default_factory=dict)
    children: dict[str, None] = field(default_factory=dict)
    variables: Variables = field(default_factory=dict)


@dataclass
class Inventory:
    """What an inventory file has; the group ``all`` has every host."""

    groups: dict[str, Group] = field(default_factory=lambda: {"all": Group()})
    host_variables: dict[str, Variables] = field(default_factory=dict)
    unread: list[Unread] = field(default_factory=list)
    values: int = 0  # how many times a host, or a variable of a host, is written or expanded

    def group(self, name: str) -> Group:
        """Returns a group, a new one if there is none of this name."""
        return self.groups.setdefault(name, Group())

    def add_hosts(self, names: Sequence[str], group: str, variables: Variables, place: Place) -> str:
        """Adds hosts with their variables to a group; says so if they are too many."""
        self.values += len(names) * (1 + len(variables))
        if len(self.hosts) + len(names) > MAX_HOSTS or self.is_full:
            return "the inventory has too many hosts"
        for name in names:
            for one in dict.fromkeys(("all", group)):
                self.group(one).hosts.setdefault(name, place)
            self.host_variables.setdefault(name, {}).update(variables)
        return ""

    @property
    def hosts(self) -> Mapping[str, Place]:
        """Every host and the line that names it first."""
        return self.groups["all"].hosts

    @property
    def is_full(self) -> bool:
        """True if no further host is worth reading."""
        return self.values > _MAX_VALUES

    def excess(self) -> str:
        """Says what the inventory has too much of to be worked out; empty if nothing."""
        if len(self.groups) > _MAX_GROUPS:
            return f"it has more than {_MAX_GROUPS} groups"
        of_groups = sum(len(one.variables) for one in self.groups.values())
        return "it has too many variables" if len(self.hosts) * of_groups > _MAX_VALUES else ""

    def depths(self) -> Mapping[str, int]:
        """The depth of each group below `all`; a group that contains itself counts once."""
        depths = {"all": 0} | dict.fromkeys(self.groups.keys() - {"all"}, 1)
        for _ in range(min(len(self.groups), 20)):
            before = dict(depths)
            for name, group in self.groups.items():
                for child in group.children:
                    if child != "all":
                        depths[child] = min(max(depths.get(child, 1), depths[name] + 1), 20)
            if depths == before:
                break
        return depths

    def memberships(self) -> Mapping[str, list[str]]:
        """The groups of each host, from the general to the specific; of equal ones in alphabetical order."""
        depths = self.depths()
        parents: dict[str, set[str]] = {name: set() for name in self.groups}
        for name, group in self.groups.items():
            for child in group.children:
                parents.setdefault(child, set()).add(name)
        found: dict[str, set[str]] = {host: {"all"} for host in self.hosts}
        for name, group in self.groups.items():
            above = _above(name, parents)
            for host in group.hosts:
                found[host] |= above
        return {
            host: sorted(groups, key=lambda one: (depths.get(one, 1), one)) for host, groups in found.items()
        }


def _above(name: str, parents: Mapping[str, set[str]]) -> set[str]:
    found, waiting = {name}, [name]
    while waiting:
        new = parents.get(waiting.pop(), set()) - found
        found |= new
        waiting += new
    return found


def expanded(pattern: str) -> tuple[str, ...] | str:
    """Returns the host names of a pattern such as `robot[01:12]`, or says why it cannot be read."""
    match = _RANGE.search(pattern)
    if match is None:
        return (pattern,)
    parts = _range(match[1], match[2], int(match[3] or 1))
    if isinstance(parts, str):
        return parts
    found: list[str] = []
    for part in parts:
        rest = expanded(pattern[: match.start()] + part + pattern[match.end() :])
        if isinstance(rest, str):
            return rest
        found += rest
        if len(found) > MAX_HOSTS:
            return f"it has more than {MAX_HOSTS} hosts"
    return tuple(found)


def _range(first: str, last: str, step: int) -> tuple[str, ...] | str:
    if first.isdigit() != last.isdigit() or step == 0 or len(last) > 9 or len(first) > 9:
        return f"`[{first}:{last}]` is no range"
    if not first.isdigit():
        numbers = range(ord(first), ord(last) + 1, step)
        return tuple(map(chr, numbers)) or f"`[{first}:{last}]` is no range"
    if len(range(int(first), int(last) + 1, step)) > MAX_HOSTS:
        return f"it has more than {MAX_HOSTS} hosts"
    width = len(first) if first.startswith("0") else 0
    numbers = range(int(first), int(last) + 1, step)
    return tuple(str(one).zfill(width) for one in numbers) or f"`[{first}:{last}]` is no range"


def without_port(name: str) -> tuple[str, str]:
    """Returns the name and the port of a host written as `name:22` or `[address]:22`; no port: empty."""
    match = re.fullmatch(r"\[([0-9a-fA-F:.]+)\](?::([0-9]{1,5}))?|([^:]+):([0-9]{1,5})", name, re.ASCII)
    if match is None:
        return name, ""
    return match[1] or match[3], match[2] or match[4] or ""


def computed(variables: Mapping[str, Variable]) -> Iterator[Unread]:
    """Yields the variables that a template computes."""
    for name, one in variables.items():
        if COMPUTED.search(one.value):
            yield Unread(one.place, f"{name} is computed by a template")
