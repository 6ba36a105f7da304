"""A swarm as text: each island with its hosts, and the programs and robots of each host."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from rich.text import Text

from swarmctl.analysis.diagram import Diagram, Edge, Node
from swarmctl.views.equal_hosts import FEW, grouped
from swarmctl.views.escape import printable
from swarmctl.views.graph.analyses import NUMBER
from swarmctl.yamltext import hostlist

_BESIDE = ("network", "commands", "data")  # edges of a host that lead to no robot or program of it
Edges = Mapping[str, Sequence[Edge]]  # by the id of a node


@dataclass(frozen=True)
class _Child:
    """A robot or program of a host."""

    kind: str
    name: str
    detail: str
    link: str
    label: str  # what identifies the link at its host
    by: str  # its commanders

    @property
    def pattern(self) -> tuple[str, ...]:
        """Equal for those that differ only in their names and numbers of their links."""
        return self.kind, self.detail, self.link, NUMBER.sub("#", self.label), self.by


@dataclass(frozen=True)
class _Host:
    name: str
    detail: str
    networks: str
    children: tuple[_Child, ...]

    @property
    def pattern(self) -> tuple[object, ...]:
        """Equal for hosts that differ only in names and numbers."""
        return self.detail, self.networks, tuple(child.pattern for child in self.children)


def overview(diagram: Diagram, *, details: bool = False) -> Text:
    """The swarm as a tree; equal hosts share lines, as equal robots of one do, unless with ``details``."""
    nodes = {node.id: node for node in diagram.nodes}
    from_each: defaultdict[str, list[Edge]] = defaultdict(list)
    commands_to: defaultdict[str, list[Edge]] = defaultdict(list)
    for edge in diagram.edges:
        from_each[edge.start].append(edge)
        if edge.kind == "commands":
            commands_to[edge.end].append(edge)
    groups = [
        (f"island {island}", f", master on {hub}" if hub else "", island) for island, hub in diagram.islands
    ]
    text = Text.assemble((diagram.swarm, "bold"), f": mode {diagram.mode}")
    folded = False
    for title, rest, island in [*groups, ("without ROS", "", "")]:
        hosts = [
            _host(node, from_each[node.id], nodes, commands_to)
            for node in diagram.nodes
            if node.kind == "host" and node.island == island and node.id not in diagram.outside
        ]
        if hosts:
            text.append(f"\n\n{title}", "bold").append(rest)
        for same in grouped(hosts, lambda host: host.pattern, lambda group: details or len(group) <= FEW):
            lines, shorter = _lines(same, details=details)
            text.append_text(lines)
            folded = folded or shorter
    text.append_text(_crossings(diagram))
    return (
        text.append("\n\nequal hosts and robots are together (--details: each of them)") if folded else text
    )


def _host(host: Node, edges: Sequence[Edge], nodes: Mapping[str, Node], commands: Edges) -> _Host:
    beside = ", ".join(nodes[edge.end].name for edge in edges if edge.kind == "network")
    children = tuple(
        _child(edge, nodes[edge.end], _commanders(commands[edge.end], nodes))
        for edge in edges
        if edge.kind not in _BESIDE
    )
    return _Host(host.name, printable(host.detail), f"on {beside}" if beside else "on no network", children)


def _child(edge: Edge, node: Node, by: str) -> _Child:
    link = "" if edge.kind == "runs" else f" by {edge.kind}"
    return _Child(node.kind, node.name, printable(node.detail), link, edge.label if link else "", by)


def _lines(same: Sequence[_Host], *, details: bool) -> tuple[Text, bool]:
    """Equal hosts with what is below them; True if something is folded."""
    first, folded = same[0], len(same) > 1
    text = Text.assemble(("\n  " + _names(host.name for host in same), "cyan"))
    text.append(f"  {len(same)} hosts, each {first.detail}" if folded else f"  {first.detail}")
    text.append(f"; {first.networks}")
    columns = list(zip(*(host.children for host in same), strict=True))
    for rows in grouped(columns, lambda row: row[0].pattern, lambda rows: details or len(rows) <= FEW):
        folded = folded or len(rows) > 1
        text.append(f"\n    {_line([child for row in rows for child in row])}")
    return text, folded


def _line(same: Sequence[_Child]) -> str:
    one = same[0]
    how = f"{one.link} {_names(child.label for child in same)}".rstrip() if one.link else ""
    by = f"; commanded by {one.by}" if one.by else ""
    return f"{one.kind} {_names(child.name for child in same)}  {one.detail}{how}{by}"


def _names(names: Iterable[str]) -> str:
    return printable(hostlist.written(names))


def _commanders(commands: Sequence[Edge], nodes: Mapping[str, Node]) -> str:
    return ", ".join(dict.fromkeys(nodes[edge.start].name for edge in commands))


def _crossings(diagram: Diagram) -> Text:
    """The bridged topics between islands; empty with one island."""
    if not diagram.provider:
        return Text()
    if not diagram.crossings:
        return Text("\n\nno topic is bridged between the islands")
    text = Text.assemble("\n\n", ("between the islands", "bold"), f", by {diagram.provider}")
    for one in diagram.crossings:
        text.append(f"\n  {printable(one.topic)}", "cyan")
        text.append(f"  {printable(one.type)} from {one.origin} to {', '.join(one.to)}")
    return text
