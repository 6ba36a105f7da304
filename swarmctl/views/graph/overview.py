"""A swarm as text: each island with its hosts, and under each host what runs on it and hangs on it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

from rich.text import Text

from swarmctl.topology.picture import Edge, Node, Picture
from swarmctl.views.text import printable

_BELOW = ("runs", "serial", "bluetooth")
Edges = Mapping[str, Sequence[Edge]]  # by the id of a node


def overview(picture: Picture) -> Text:
    """The whole swarm as a tree."""
    nodes = {node.id: node for node in picture.nodes}
    from_each: defaultdict[str, list[Edge]] = defaultdict(list)
    orders_to: defaultdict[str, list[Edge]] = defaultdict(list)
    for edge in picture.edges:
        from_each[edge.start].append(edge)
        if edge.kind == "orders":
            orders_to[edge.end].append(edge)
    groups = [(f"island {island}", f", master on {hub}", island) for island, hub in picture.islands]
    text = Text.assemble((picture.swarm, "bold"), f": mode {picture.mode}")
    for title, rest, island in [*groups, ("without ROS", "", "")]:
        hosts = [node for node in picture.nodes if node.kind == "host" and node.island == island]
        if hosts:
            text.append(f"\n\n{title}", "bold").append(rest)
        for host in hosts:
            text.append_text(_host(host, from_each[host.id], nodes, orders_to))
    return text.append_text(_crossings(picture))


def _host(host: Node, edges: Sequence[Edge], nodes: Mapping[str, Node], orders: Edges) -> Text:
    beside = ", ".join(nodes[edge.end].name for edge in edges if edge.kind == "network")
    text = Text.assemble(("\n  " + host.name, "cyan"), f"  {printable(host.detail)}")
    text.append(f"; on {beside}" if beside else "; on no network")
    for edge in edges:
        if edge.kind in _BELOW:
            text.append(f"\n    {_below(edge, nodes[edge.end])}{_ordered(orders[edge.end], nodes)}")
    return text


def _crossings(picture: Picture) -> Text:
    """What one island hears of another, and how; with one island there is nothing to say."""
    if not picture.provider:
        return Text()
    if not picture.crossings:
        return Text("\n\nnothing crosses between the islands")
    text = Text.assemble("\n\n", ("between the islands", "bold"), f", by {picture.provider}")
    for one in picture.crossings:
        text.append(f"\n  {printable(one.topic)}", "cyan")
        text.append(f"  {printable(one.type)} from {one.origin} to {', '.join(one.to)}")
    return text


def _below(edge: Edge, node: Node) -> str:
    how = "" if edge.kind == "runs" else f" by {edge.kind} {edge.label}".rstrip()
    return f"{node.kind} {node.name}  {printable(node.detail)}{how}"


def _ordered(orders: Sequence[Edge], nodes: Mapping[str, Node]) -> str:
    by = dict.fromkeys(nodes[edge.start].name for edge in orders)
    return f"; commanded by {', '.join(by)}" if by else ""
