"""A swarm as a graph for Graphviz: `swarmctl graph --format dot SPEC | dot -Tsvg`."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.analysis.diagram import Diagram, Edge, Node
from swarmctl.plugins import LINK_KINDS

_SHAPE = {"host": "box3d", "robot": "ellipse", "network": "hexagon", "program": "component"}
_STYLE = {
    "network": "dir=none",
    "runs": "dir=none, color=gray",
    "commands": "style=dashed, color=red, constraint=false",
    "data": "style=dashed, color=blue, constraint=false",
}
_WIRED = {True: "dir=none, penwidth=2", False: "dir=none, style=dotted, penwidth=2"}


def graph(diagram: Diagram) -> str:
    """The whole graph; each island is a cluster."""
    return "".join(f"{line}\n" for line in _lines(diagram))


def _lines(diagram: Diagram) -> Iterator[str]:
    yield f"digraph {_quoted(diagram.swarm)} {{"
    yield f"  label={_quoted(f'{diagram.swarm}: mode {diagram.mode}')};"
    yield "  node [fontname=sans]; edge [fontname=sans, fontsize=10];"
    for number, (island, hub) in enumerate(diagram.islands):
        yield f"  subgraph cluster_{number} {{"
        yield f"    label={_quoted(f'{island}, master on {hub}' if hub else island)};"
        yield from (f"    {_node(node)}" for node in diagram.nodes if node.island == island)
        yield "  }"
    islands = {name for name, _ in diagram.islands}
    yield from (f"  {_node(node)}" for node in diagram.nodes if node.island not in islands)
    yield from (f"  {_edge(edge)}" for edge in diagram.edges)
    yield "}"


def _node(node: Node) -> str:
    return f"{_quoted(node.id)} [label={_quoted(node.name, node.detail)}, shape={_SHAPE[node.kind]}];"


def _edge(edge: Edge) -> str:
    label = f"label={_quoted(edge.label)}, " if edge.label else ""
    style = _STYLE.get(edge.kind) or _WIRED[LINK_KINDS.get(edge.kind).wired]
    return f"{_quoted(edge.start)} -> {_quoted(edge.end)} [{label}{style}];"


def _quoted(*lines: str) -> str:
    """A quoted string of DOT, in which a quote and a backslash stand for themselves."""
    escaped = (line.replace("\\", "\\\\").replace('"', '\\"') for line in lines)
    return '"' + "\\n".join(escaped) + '"'
