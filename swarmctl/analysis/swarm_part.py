"""A part of a swarm: some of its hosts, with what concerns them in each analysis. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

from swarmctl.analysis.budgets import Budgets
from swarmctl.analysis.command_paths import CommandPath
from swarmctl.analysis.diagram import Diagram
from swarmctl.analysis.impact import Impact
from swarmctl.analysis.swarm_graph import Graph, Node
from swarmctl.swarm.flow import Flow
from swarmctl.swarm.index import SwarmIndex

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
