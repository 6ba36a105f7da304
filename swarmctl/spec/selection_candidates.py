"""What a selection can name in one swarm: hosts, robots, programs, islands, groups and labels."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, TypeAlias

Kind: TypeAlias = Literal["hosts", "robots"]


@dataclass(frozen=True)
class RobotFacts:
    """What selections use of a robot."""

    type: str = ""
    host: str | None = None
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProgramFacts:
    """What selections use of a program."""

    host: str | None = None
    robot: str | None = None


@dataclass(frozen=True)
class IslandFacts:
    """What selections use of an island; its hosts may be selections."""

    mode: str = ""
    hosts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Candidates:
    """Everything that a selection can name, in the order of the spec; ``hosts`` with their labels."""

    hosts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    robots: Mapping[str, RobotFacts] = field(default_factory=dict)
    programs: Mapping[str, ProgramFacts] = field(default_factory=dict)
    islands: Mapping[str, IslandFacts] = field(default_factory=dict)
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    mode: str = ""

    def of(self, kind: Kind) -> Collection[str]:
        """Returns the names of all hosts, or of all robots."""
        return self.hosts if kind == "hosts" else self.robots

    def host_of_program(self, name: str) -> str | None:
        """Returns the host that a program runs on; None if the swarm has none for it."""
        program = self.programs[name]
        robot = self.robots.get(program.robot or "")
        host = program.host or (robot.host if robot else None)
        return host if host in self.hosts else None

    def named(self, prefix: str) -> Collection[str]:
        """Returns what can stand after a prefix of the grammar."""
        known: Mapping[str, Collection[str]] = {
            "": self.hosts_and_robots,
            "host": self.hosts,
            "robot": self.robots,
            "program": self.programs,
            "type": self.types,
            "@": self.groups_and_labels,
            "island": self.islands,
            "mode": self.modes,
        }
        return known[prefix]

    @cached_property
    def hosts_and_robots(self) -> Collection[str]:
        """The names of hosts and robots, each once."""
        return dict.fromkeys((*self.hosts, *self.robots))

    @cached_property
    def groups_and_labels(self) -> Collection[str]:
        """The names of groups and labels, each once."""
        return dict.fromkeys((*self.groups, *self.labels))

    @cached_property
    def modes(self) -> Collection[str]:
        """The modes of the islands; without islands that of the swarm."""
        modes = [island.mode for island in self.islands.values()] if self.islands else [self.mode]
        return dict.fromkeys(modes)

    @cached_property
    def labels(self) -> Mapping[str, tuple[frozenset[str], frozenset[str]]]:
        """The hosts and the robots of each label."""
        hosts: dict[str, set[str]] = {}
        robots: dict[str, set[str]] = {}
        for name, labels in self.hosts.items():
            for label in labels:
                hosts.setdefault(label, set()).add(name)
        for name, robot in self.robots.items():
            for label in robot.labels:
                robots.setdefault(label, set()).add(name)
        return {
            label: (frozenset(hosts.get(label, ())), frozenset(robots.get(label, ())))
            for label in (*hosts, *robots)
        }

    @cached_property
    def robots_of(self) -> Mapping[str, frozenset[str]]:
        """The robots that each host drives; none for a host without robots."""
        found: dict[str, set[str]] = {}
        for name, robot in self.robots.items():
            if robot.host is not None:
                found.setdefault(robot.host, set()).add(name)
        return {host: frozenset(robots) for host, robots in found.items()}

    @cached_property
    def types(self) -> Mapping[str, frozenset[str]]:
        """The robots of each type."""
        found: dict[str, set[str]] = {}
        for name, robot in self.robots.items():
            found.setdefault(robot.type, set()).add(name)
        return {kind: frozenset(robots) for kind, robots in found.items()}
