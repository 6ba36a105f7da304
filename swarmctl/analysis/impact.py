"""What is lost if one part of a swarm fails: host, master, multimaster, network, program, robot. Pure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from swarmctl.analysis.budgets import Budgets
from swarmctl.analysis.command_paths import CommandPath
from swarmctl.analysis.diagram import Diagram
from swarmctl.analysis.swarm_graph import COMMANDS, DATA, KINDS, Graph, Node, needed, node, swarm_graph
from swarmctl.swarm.flow import Flow
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


_ACROSS = frozenset({"commands", "data"})  # the edges that are shown if one end is in the part


@dataclass(frozen=True)
class Part:
    """Some hosts, the robots and programs that run on them, and their networks; by kind, as in a diagram."""

    names: frozenset[tuple[str, str]]

    def has(self, kind: str, name: str) -> bool:
        """True if the part has the host, robot, program or network of that name."""
        return (kind, name) in self.names

    def graph(self, whole: Graph[Node]) -> Graph[Node]:
        """Returns the part of a graph, with everything that its hosts run, reach or command."""
        own = [one for one, part in whole.nodes(data=True) if self.has(part["kind"], part["name"])]
        beside = (end for one in own if whole.nodes[one]["kind"] == "host" for end in whole.successors(one))
        return whole.subgraph([*own, *beside])

    def diagram(self, whole: Diagram) -> Diagram:
        """Returns the part of a diagram, and from outside what commands it or exchanges data with it."""
        inside = {node.id for node in whole.nodes if self.has(node.kind, node.name)}
        edges = [
            edge
            for edge in whole.edges
            if inside.issuperset((edge.start, edge.end))
            or (edge.kind in _ACROSS and not inside.isdisjoint((edge.start, edge.end)))
        ]
        shown = inside.union(*((edge.start, edge.end) for edge in edges))
        nodes = tuple(node for node in whole.nodes if node.id in shown)
        islands = {node.island for node in nodes}
        return replace(
            whole,
            islands=tuple(island for island in whole.islands if island[0] in islands),
            nodes=nodes,
            outside=frozenset(shown - inside),
            edges=tuple(edges),
            crossings=tuple(one for one in whole.crossings if not islands.isdisjoint((one.origin, *one.to))),
        )

    def impacts(self, whole: Iterable[Impact]) -> tuple[Impact, ...]:
        """Returns the failures of what the part has, and those that cost it a robot, a program or data."""
        return tuple(one for one in whole if self.has(one.kind, one.name) or self._loses(one))

    def _loses(self, impact: Impact) -> bool:
        programs = (*impact.programs, *(program for _, program in impact.data))
        return any(self.has("robot", name) for name in impact.robots) or any(
            self.has("program", name) for name in programs
        )

    def paths(self, whole: Iterable[CommandPath]) -> tuple[CommandPath, ...]:
        """Returns the paths to the robots of the part."""
        return tuple(one for one in whole if self.has("robot", one.robot))

    def flows(self, whole: Iterable[Flow]) -> tuple[Flow, ...]:
        """Returns the flows from and to the hosts of the part."""
        return tuple(
            one for one in whole if any(self.has("host", name) for name in (*one.sources, *one.hosts))
        )

    def budgets(self, whole: Budgets) -> Budgets:
        """Returns the budgets of what the part has; those of its networks count what others send too."""
        return Budgets(
            lines=tuple(one for one in whole.lines if self.has("host", one.host)),
            radios=tuple(one for one in whole.radios if self.has("host", one.host)),
            dongles=tuple(one for one in whole.dongles if self.has("host", one.host)),
            ip_links=tuple(one for one in whole.ip_links if self.has("host", one.host)),
            boards=tuple(one for one in whole.boards if self.has(one.kind, one.owner)),
            hosts=tuple(one for one in whole.hosts if self.has("host", one.host)),
            networks=tuple(one for one in whole.networks if self.has("network", one.network)),
        )


def part_of(index: SwarmIndex, hosts: Collection[str]) -> Part:
    """Returns the part of a swarm that ``hosts`` are."""
    names = {("host", host) for host in hosts}
    names |= {("robot", name) for name, host in index.driving.items() if host in hosts}
    names |= {("program", name) for name, host in index.program_hosts.items() if host in hosts}
    names |= {("network", link.name) for _, link in index.networks if not set(hosts).isdisjoint(link.hosts)}
    return Part(frozenset(names))
