"""A swarm as a Mermaid flowchart, for pages that draw it themselves, as those of GitHub and GitLab do."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from swarmctl.analysis.diagram import Diagram, Edge, Node
from swarmctl.plugins import LINK_KINDS

_SHAPE = {"host": ("[", "]"), "robot": ("([", "])"), "network": ("{{", "}}"), "program": ("[[", "]]")}
_ARROW = {
    "network": "---",
    "runs": "---",
    "commands": "-.->",
    "data": "-->",
}
_WIRED = {True: "===", False: "-.-"}
_PLAIN = re.compile(r"[^A-Za-z0-9 .,:/()_-]")


def graph(diagram: Diagram) -> str:
    """The whole flowchart; each island is a subgraph. Ids are numbers: no name can be a word of Mermaid."""
    ids = {node.id: f"n{number}" for number, node in enumerate(diagram.nodes)}
    return "".join(f"{line}\n" for line in _lines(diagram, ids))


def _lines(diagram: Diagram, ids: Mapping[str, str]) -> Iterator[str]:
    yield "flowchart LR"
    for number, (island, hub) in enumerate(diagram.islands):
        yield f"  subgraph i{number}[{_quoted(f'{island}, master on {hub}' if hub else island)}]"
        yield from (f"    {_node(node, ids)}" for node in diagram.nodes if node.island == island)
        yield "  end"
    islands = {name for name, _ in diagram.islands}
    yield from (f"  {_node(node, ids)}" for node in diagram.nodes if node.island not in islands)
    yield from (f"  {_edge(edge, ids)}" for edge in diagram.edges)


def _node(node: Node, ids: Mapping[str, str]) -> str:
    opening, closing = _SHAPE[node.kind]
    return f"{ids[node.id]}{opening}{_quoted(node.name, node.detail)}{closing}"


def _edge(edge: Edge, ids: Mapping[str, str]) -> str:
    label = f"|{_quoted(edge.label)}|" if edge.label else ""
    arrow = _ARROW.get(edge.kind) or _WIRED[LINK_KINDS.get(edge.kind).wired]
    return f"{ids[edge.start]} {arrow}{label} {ids[edge.end]}"


def _quoted(*lines: str) -> str:
    """A text in quotes; whatever Mermaid or HTML could take for its own is written as its number."""
    return '"' + "<br/>".join(_PLAIN.sub(lambda found: f"#{ord(found[0])};", line) for line in lines) + '"'
