"""What is lost if one part of a swarm fails: host, master, multimaster, network, program, robot. Pure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from swarmctl.analysis.swarm_graph import COMMANDS, DATA, KINDS, Graph, Node, needed, node, swarm_graph
from swarmctl.swarm.index import SwarmIndex
from swarmctl.yamltext.source import collector_paused


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
    optional: frozenset[str] = field(default=frozenset())  # all optional robots and programs

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots that are out of service."""
        return (*self.drivers, *self.command)

    @property
    def missed(self) -> tuple[str, ...]:
        """Those of them that are not optional."""
        return tuple(robot for robot in self.robots if robot not in self.optional)

    @property
    def missed_programs(self) -> tuple[str, ...]:
        """The programs that end and are not optional."""
        return tuple(program for program in self.programs if program not in self.optional)

    @property
    def weight(self) -> tuple[int, ...]:
        """How much is lost, to sort by: robots and programs, and of equal sums the one with more robots."""
        drivers = len([robot for robot in self.drivers if robot not in self.optional])
        missed = len(self.missed)
        robots, programs = len(self.robots), len(self.programs)
        both = missed + len(self.missed_programs)
        return both, missed, drivers, robots, len(self.masters), programs, len(self.data)

    @property
    def harmless(self) -> bool:
        """True if nothing else fails with it."""
        return not any(self.weight)

    @property
    def single_point(self) -> bool:
        """True if more is lost with the part than the robot, or the program, that it belongs to."""
        several = len(self.robots) > 1 or len(self.missed_programs) > 1
        return several or self.shared or (self.kind == "program" and bool(self.robots))

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
            "optional": [name for name in (*self.robots, *self.programs) if name in self.optional],
        }


@collector_paused()
def impacts(index: SwarmIndex) -> tuple[Impact, ...]:
    """Returns one entry for each part, the worst first; equal ones by kind, then in the order of the spec."""
    graph = swarm_graph(index)
    robots = [name for name in index.spec.robots if _is_optional(index, name)]
    programs = [name for name in index.spec.programs if _may_be_missing(index, name)]
    optional = frozenset([*robots, *programs])
    shared = {island.name for island in index.islands if len(island.hosts) > 1}
    lost = _lost(graph)
    found = [
        Impact(
            kind=part["kind"],
            name=part["name"],
            drivers=tuple(lost.get((one, "robot"), ())),
            command=tuple(lost.get((one, COMMANDS), ())),
            masters=tuple(lost.get((one, "master"), ())),
            programs=tuple(
                program for program in lost.get((one, "program"), ()) if one != node("program", program)
            ),
            data=tuple(lost.get((one, DATA), ())),
            shared=not shared.isdisjoint(lost.get((one, "master"), ())),
            optional=optional,
        )
        for one, part in graph.nodes(data=True)
    ]
    by_kind = sorted(found, key=lambda one: KINDS.index(one.kind))
    return tuple(sorted(by_kind, key=lambda one: one.weight, reverse=True))


def _lost(graph: Graph[Node]) -> Mapping[tuple[Node, str], list[Any]]:
    """By part and kind, the names of what is lost with the part.

    A robot is not commanded any more if a part is lost that all its commands need, and a program does not
    receive a topic if all publishers of it need the part; robots and programs that end themselves are not
    named again.
    """
    needs = needed(graph)
    lost: dict[tuple[Node, str], list[Any]] = defaultdict(list)
    for one, part in graph.nodes(data=True):
        name = part["name"]
        for needed_part in needs[one]:
            lost[needed_part, part["kind"]].append(name)
        ways: dict[tuple[str, Any], list[set[Node]]] = defaultdict(list)
        for *_, edge in graph.in_edges(one, data=True):
            if edge["carriers"]:
                what = (edge["label"], name) if edge["role"] == DATA else name
                ways[edge["role"], what].append(set().union(*(needs[each] for each in edge["carriers"])))
        for (role, what), each_needs in ways.items():
            for needed_part in set.intersection(*each_needs) - needs[one]:
                lost[needed_part, role].append(what)
    return lost


def single_points(found: Iterable[Impact]) -> tuple[Impact, ...]:
    """Returns the parts with which more is lost than the one robot they serve."""
    return tuple(one for one in found if one.single_point)


def _is_optional(index: SwarmIndex, robot: str) -> bool:
    """True if the robot is optional, or the host that drives it."""
    host = index.driving[robot]
    return index.spec.robots[robot].optional or (host is not None and index.spec.hosts[host].optional)


def _may_be_missing(index: SwarmIndex, program: str) -> bool:
    """True if the program is optional, or the host that it runs on."""
    host = index.program_hosts[program]
    return index.spec.programs[program].optional or (host is not None and index.spec.hosts[host].optional)
