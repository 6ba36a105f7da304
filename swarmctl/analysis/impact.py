"""What is lost if one part of a swarm (host, master, network, program, adapter, line, robot) fails. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Set
from dataclasses import dataclass, field

from swarmctl.analysis.dependencies import KINDS, Dependencies, Node
from swarmctl.swarm.index import SwarmIndex

_Names = tuple[str, ...]
#: The fields of ``Impact`` that a node decides, in its order.
_Lost = tuple[_Names, _Names, _Names, _Names, tuple[tuple[str, str], ...], bool]


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
    shared: bool = False  # one of the masters served several hosts
    optional: frozenset[str] = field(default=frozenset())  # all optional robots

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
        drivers = len([robot for robot in self.drivers if robot not in self.optional])
        missed = drivers + len([robot for robot in self.command if robot not in self.optional])
        robots = len(self.drivers) + len(self.command)
        return missed, drivers, robots, len(self.masters), len(self.programs), len(self.data)

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
    """Returns one entry for each part, the worst first; equal ones by kind, then in the order of the spec."""
    dependencies = Dependencies(index)
    shared = {island.name for island in index.islands if len(island.hosts) > 1}
    optional = frozenset(name for name in index.spec.robots if _is_optional(index, name))
    nodes = {part: dependencies.node_of(part) for part in dependencies.parts}
    lost = {node: _lost(dependencies, node, shared) for node in dict.fromkeys(nodes.values())}
    found = [Impact(kind, name, *lost[node], optional) for (kind, name), node in nodes.items()]
    by_kind = sorted(found, key=lambda one: KINDS.index(one.kind))
    return tuple(sorted(by_kind, key=lambda one: one.weight, reverse=True))


def _lost(dependencies: Dependencies, node: Node, shared: Set[str]) -> _Lost:
    """What is lost with a node; ``shared`` are the islands of several hosts."""
    lost = dependencies.lost_with(node)
    drivers = dict.fromkeys([one[1] for one in lost if one[0] == "driver"])
    masters = [one[1] for one in lost if one[0] == "master"]
    programs = dict.fromkeys([one[1] for one in lost if one[0] == "program"])
    return (
        tuple(drivers),
        tuple([robot for robot in dependencies.commands.cut_off(lost) if robot not in drivers]),
        tuple(masters),
        tuple([name for name in programs if ("program", name) != node]),
        tuple([flow for flow in dependencies.flows.cut_off(lost) if flow[1] not in programs]),
        not shared.isdisjoint(masters),
    )


def single_points(found: Iterable[Impact]) -> tuple[Impact, ...]:
    """Returns the parts with which more is lost than the one robot they serve."""
    return tuple(one for one in found if one.single_point)


def _is_optional(index: SwarmIndex, robot: str) -> bool:
    """True if the robot is optional, or the host that drives it."""
    host = index.driving[robot]
    return index.spec.robots[robot].optional or (host is not None and index.spec.hosts[host].optional)
