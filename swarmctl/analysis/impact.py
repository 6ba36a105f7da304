"""What is lost if one part of a swarm (host, master, network, program, adapter, line, robot) fails. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Set
from dataclasses import dataclass, field
from typing import TypeVar

from swarmctl.analysis.dependencies import KINDS, Dependencies, Node, Part
from swarmctl.swarm.index import SwarmIndex

K = TypeVar("K")


@dataclass(frozen=True)
class Impact:
    """What is lost with one part. Robots that lose their driver are not listed again in ``command``."""

    kind: str
    name: str
    drivers: tuple[str, ...] = ()  # robots that lose their driver, and stop
    command: tuple[str, ...] = ()  # robots that no commander can reach any more, and stop
    masters: tuple[str, ...] = ()  # islands in which nothing can join any more
    programs: tuple[str, ...] = ()
    data: tuple[tuple[str, str], ...] = ()  # topics, each with a running program that no longer receives it
    optional: frozenset[str] = field(default=frozenset())  # all optional robots
    shared: bool = False  # one of the masters served several hosts

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots that are out of service."""
        return (*self.drivers, *self.command)

    @property
    def missed(self) -> tuple[str, ...]:
        """Those of them that are not optional."""
        return tuple(robot for robot in self.robots if robot not in self.optional)

    @property
    def weight(self) -> tuple[int, ...]:
        """How much is lost, to sort by: robots first, and of equal ones those that lose drivers."""
        drivers = sum(robot not in self.optional for robot in self.drivers)
        lost = (self.robots, self.masters, self.programs, self.data)
        return (len(self.missed), drivers, *(len(one) for one in lost))

    @property
    def harmless(self) -> bool:
        """True if nothing else fails with it."""
        return not any(self.weight)

    @property
    def single_point(self) -> bool:
        """True if more is lost with the part than the robot it belongs to."""
        return len(self.robots) > 1 or self.shared or (self.kind == "program" and bool(self.robots))

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "kind": self.kind,
            "name": self.name,
            "drivers": list(self.drivers),
            "command": list(self.command),
            "masters": list(self.masters),
            "programs": list(self.programs),
            "data": [{"topic": topic, "program": program} for topic, program in self.data],
            "optional": [robot for robot in self.robots if robot in self.optional],
        }


def impacts(index: SwarmIndex) -> tuple[Impact, ...]:
    """One entry for each part, the worst first; equal ones by kind, then in the order of the spec."""
    dependencies = Dependencies(index)
    shared = {island.name for island in index.islands if len(island.hosts) > 1}
    optional = frozenset(name for name in index.spec.robots if _is_optional(index, name))
    found = [_impact(dependencies, part, shared, optional) for part in dependencies.parts]
    return tuple(sorted(found, key=lambda one: (*(-count for count in one.weight), KINDS.index(one.kind))))


def _impact(dependencies: Dependencies, part: Part, shared: Set[str], optional: frozenset[str]) -> Impact:
    """What is lost with ``part``; ``shared`` are the islands of several hosts."""
    lost: dict[str, list[Node]] = {}
    for node in dependencies.lost_with(part):
        lost.setdefault(node[0], []).append(node)
    drivers, masters, programs = (
        dict.fromkeys(node[1] for node in lost.get(kind, ())) for kind in ("driver", "master", "program")
    )
    commanded = _cut_off((node[2] for node in lost.get("command", ())), dependencies.commands)
    flows = _cut_off(((node[1], node[2]) for node in lost.get("flow", ())), dependencies.flows)
    return Impact(
        *part,
        drivers=tuple(drivers),
        command=tuple(robot for robot in commanded if robot not in drivers),
        masters=tuple(masters),
        programs=tuple(name for name in programs if ("program", name) != part),
        data=tuple(flow for flow in flows if flow[1] not in programs),
        optional=optional,
        shared=not shared.isdisjoint(masters),
    )


def _cut_off(lost: Iterable[K], ways: Mapping[K, Collection[Node]]) -> list[K]:
    """The keys in ``lost`` that occur there as often as they have ``ways``: none is left."""
    return [key for key, count in Counter(lost).items() if count == len(ways[key])]


def single_points(found: Iterable[Impact]) -> tuple[Impact, ...]:
    """The parts with which more is lost than the one robot they serve."""
    return tuple(one for one in found if one.single_point)


def _is_optional(index: SwarmIndex, robot: str) -> bool:
    """True if the robot is optional, or the host that drives it."""
    host = index.driving[robot]
    return index.spec.robots[robot].optional or (host is not None and index.spec.hosts[host].optional)
