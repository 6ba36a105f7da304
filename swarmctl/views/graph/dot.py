"""A swarm as a graph for Graphviz: `swarmctl graph --format dot SPEC | dot -Tsvg`."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.topology.picture import Edge, Node, Picture

_SHAPE = {"host": "box3d", "robot": "ellipse", "network": "hexagon", "program": "component"}
_STYLE = {
    "network": "dir=none",
    "serial": "dir=none, penwidth=2",
    "bluetooth": "dir=none, style=dotted, penwidth=2",
    "runs": "dir=none, color=gray",
    "orders": "style=dashed, color=red, constraint=false",
    "data": "style=dashed, color=blue, constraint=false",
}


def graph(picture: Picture) -> str:
    """The whole graph; each island is a cluster."""
    return "".join(f"{line}\n" for line in _lines(picture))


def _lines(picture: Picture) -> Iterator[str]:
    yield f"digraph {_quoted(picture.swarm)} {{"
    yield f"  label={_quoted(f'{picture.swarm}: mode {picture.mode}')};"
    yield "  node [fontname=sans]; edge [fontname=sans, fontsize=10];"
    for number, (island, hub) in enumerate(picture.islands):
        yield f"  subgraph cluster_{number} {{"
        yield f"    label={_quoted(f'{island}, master on {hub}')};"
        yield from (f"    {_node(node)}" for node in picture.nodes if node.island == island)
        yield "  }"
    islands = {name for name, _ in picture.islands}
    yield from (f"  {_node(node)}" for node in picture.nodes if node.island not in islands)
    yield from (f"  {_edge(edge)}" for edge in picture.edges)
    yield "}"


def _node(node: Node) -> str:
    return f"{_quoted(node.id)} [label={_quoted(node.name, node.detail)}, shape={_SHAPE[node.kind]}];"


def _edge(edge: Edge) -> str:
    label = f"label={_quoted(edge.label)}, " if edge.label else ""
    return f"{_quoted(edge.start)} -> {_quoted(edge.end)} [{label}{_STYLE[edge.kind]}];"


def _quoted(*lines: str) -> str:
    """A quoted string of DOT, in which a quote and a backslash stand for themselves."""
    escaped = (line.replace("\\", "\\\\").replace('"', '\\"') for line in lines)
    return '"' + "\\n".join(escaped) + '"'
