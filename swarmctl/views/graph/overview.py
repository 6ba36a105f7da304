"""A swarm as text: each island with its hosts, and the programs and robots of each host."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

from rich.text import Text

from swarmctl.analysis.diagram import Diagram, Edge, Node
from swarmctl.views.escape import printable

_BELOW = ("runs", "serial", "bluetooth", "udp", "tcp", "radio")
Edges = Mapping[str, Sequence[Edge]]  # by the id of a node


def overview(diagram: Diagram) -> Text:
    """The whole swarm as a tree."""
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
    for title, rest, island in [*groups, ("without ROS", "", "")]:
        hosts = [node for node in diagram.nodes if node.kind == "host" and node.island == island]
        if hosts:
            text.append(f"\n\n{title}", "bold").append(rest)
        for host in hosts:
            text.append_text(_host(host, from_each[host.id], nodes, commands_to))
    return text.append_text(_crossings(diagram))


def _host(host: Node, edges: Sequence[Edge], nodes: Mapping[str, Node], commands: Edges) -> Text:
    beside = ", ".join(nodes[edge.end].name for edge in edges if edge.kind == "network")
    text = Text.assemble(("\n  " + host.name, "cyan"), f"  {printable(host.detail)}")
    text.append(f"; on {beside}" if beside else "; on no network")
    for edge in edges:
        if edge.kind in _BELOW:
            text.append(f"\n    {_below(edge, nodes[edge.end])}{_commanded(commands[edge.end], nodes)}")
    return text


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


def _below(edge: Edge, node: Node) -> str:
    how = "" if edge.kind == "runs" else f" by {edge.kind} {edge.label}".rstrip()
    return f"{node.kind} {node.name}  {printable(node.detail)}{how}"


def _commanded(commands: Sequence[Edge], nodes: Mapping[str, Node]) -> str:
    by = dict.fromkeys(nodes[edge.start].name for edge in commands)
    return f"; commanded by {', '.join(by)}" if by else ""
