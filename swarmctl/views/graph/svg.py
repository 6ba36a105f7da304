"""A swarm as a picture, SVG: `swarmctl graph --format svg`, and what the page of `swarmctl ui` shows."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from swarmctl.analysis.diagram import Diagram, Edge, Node
from swarmctl.plugins import LINK_KINDS
from swarmctl.resources import templates
from swarmctl.views.escape import printable
from swarmctl.views.graph.layout import BAR, HEADER, INDENT, PART, TITLE, Box, Layout, Trunk, layout

_FEW = 24  # flows that the eye can follow at the same time; more are drawn for what is selected
_PER_CHARACTER = {"name": 7.2, "detail": 5.9, "title": 6.8}  # px of an average character
_LEGEND = {
    "network": ("wire network", "network"),
    "wired": ("wire", "cable, or on the host"),
    "radio": ("wire radio", "radio"),
    "commands": ("flow commands", "commands"),
    "data": ("flow data", "data"),
    "bridge": ("flow bridge", "topics between islands"),
}
_EDGE = 16.0  # px beside the legend
_BEND = 44.0  # px that an arrow bends at least
_ROW = 18.0  # px of a row of the legend


def graph(diagram: Diagram) -> str:
    """The whole picture, with its style."""
    image = picture(diagram)
    style = Element("style")
    style.text = (templates() / "page/graph.css").read_text("utf-8")
    image.insert(0, style)
    indent(image)
    return tostring(image, encoding="unicode") + "\n"


def picture(diagram: Diagram) -> Element:
    """The picture without style. ``data-id`` is the id of a node; an edge has those of both ends."""
    places = layout(diagram)
    image = Element("svg", {"xmlns": "http://www.w3.org/2000/svg", "class": "swarm", "role": "group"})
    SubElement(image, "title").text = printable(f"{diagram.swarm}: mode {diagram.mode}")
    kinds = set()
    for name, box in places.islands.items():
        _island(image, name, box)
    for trunk in places.trunks:
        kinds.add("network")
        _trunk(image, trunk, places)
    nodes = {node.id: node for node in diagram.nodes}
    below = {edge.end for edges in places.parts.values() for edge in edges}
    for one in nodes.values():
        if one.id not in below:
            _node(image, one, places.nodes[one.id])
            for edge in places.parts.get(one.id, ()):
                kinds.add(_wire(image, edge, places))
                _node(image, nodes[edge.end], places.nodes[edge.end])
    flows = [edge for edge in diagram.edges if edge.kind in ("commands", "data")]
    many = len(flows) > _FEW
    for edge in flows:
        kinds.add(edge.kind)
        _flow(image, edge, places.nodes[edge.start], places.nodes[edge.end])
    if many:
        image.set("class", "swarm many")
    for edge in _bridges(diagram):
        kinds.add("bridge")
        _flow(image, edge, _title_of(places.islands[edge.start]), _title_of(places.islands[edge.end]))
    width = places.size.width
    note = f"{len(flows)} commands and data; the page (--format html) draws those of what is selected"
    height = _legend(image, kinds, places.size, note if many else "")
    image.set("viewBox", f"0 0 {width:g} {height:g}")
    image.set("width", f"{width:g}")
    image.set("height", f"{height:g}")
    return image


def _island(image: Element, name: str, box: Box) -> None:
    group = SubElement(image, "g", {"class": "group"})
    _rect(group, "island", box, 10)
    _text(group, "title", (box.x + 12, box.y + 20), f"island {name}" if name else "without ROS", box.width)


def _node(image: Element, node: Node, box: Box) -> Element:
    """A node with its name and detail; each kind has a shape."""
    group = SubElement(image, "g", {"class": f"node {node.kind}", "data-id": node.id})
    SubElement(group, "title").text = printable(f"{node.kind} {node.name}: {node.detail}")
    radius = {"robot": PART / 2, "network": BAR / 2, "program": 0.0}.get(node.kind, 8.0)
    _rect(group, "shape", box, radius)
    if node.kind == "program":
        _path(group, "wire", f"M{box.x + 6:g} {box.y:g}V{box.bottom:g}")
    if node.kind == "network":
        _text(group, "name", (box.x + 16, box.y + 20), f"{node.name} · {node.detail}", box.width)
        return group
    left, width = box.x + (18 if node.kind != "host" else 12), box.width - 50
    _text(group, "name", (left, box.y + 17), node.name, width)
    _text(group, "detail", (left, box.y + 32), node.detail, width)
    return group


def _wire(image: Element, edge: Edge, places: Layout) -> str:
    """The link of a robot or program below its host: a line if it is a cable, dots if it is a radio."""
    card, box = places.nodes[edge.start], places.nodes[edge.end]
    wired = edge.kind == "runs" or LINK_KINDS.get(edge.kind).wired
    x, y = card.x + INDENT / 2, box.y + box.height / 2
    path = f"M{x:g} {card.y + HEADER - 8:g}V{y:g}H{box.x:g}"
    line = _path(image, "wire" if wired else "wire radio", path, edge)
    SubElement(line, "title").text = printable(f"{edge.kind} {edge.label}".rstrip())
    return "wired" if wired else "radio"


def _trunk(image: Element, trunk: Trunk, places: Layout) -> None:
    x = f"{trunk.x:g}"
    _path(image, "wire network", f"M{x} {trunk.top:g}V{max(y for _, y in trunk.taps):g}")
    for host, y in trunk.taps:
        edge = Edge("network", host, trunk.network)
        _path(image, "wire network", f"M{x} {y:g}H{places.nodes[host].x:g}", edge)
        SubElement(image, "circle", {"class": "dot", "cx": x, "cy": f"{y:g}", "r": "3"})


def _flow(image: Element, edge: Edge, start: Box, end: Box) -> None:
    """An arrow between the facing sides of two boxes; between their right sides if one is below the other."""
    aside = start.x < end.right and end.x < start.right
    backwards = not aside and end.x < start.x
    x1 = start.x if backwards else start.right
    x2 = end.right if aside or backwards else end.x
    y1, y2 = start.y + min(start.height, HEADER) / 2, end.y + end.height / 2
    pull = _BEND if aside else max(_BEND, abs(x2 - x1) / 2)
    out, into = (-pull if backwards else pull), (pull if x2 == end.right else -pull)
    path = f"M{x1:g} {y1:g}C{x1 + out:g} {y1:g} {x2 + into:g} {y2:g} {x2:g} {y2:g}"
    line = _path(image, f"flow {edge.kind}", path, edge)
    SubElement(line, "title").text = printable(f"{edge.kind} {edge.label}".rstrip())
    _path(image, f"tip {edge.kind}", f"M{x2:g} {y2:g}l{math.copysign(8, into):g} -4v8z", edge)


def _bridges(diagram: Diagram) -> Iterator[Edge]:
    """From island to island, with the topics that are bridged."""
    topics: dict[tuple[str, str], list[str]] = {}
    for one in diagram.crossings:
        for to in one.to:
            topics.setdefault((one.origin, to), []).append(one.topic)
    for (origin, to), names in topics.items():
        yield Edge("bridge", origin, to, f"by {diagram.provider}: {', '.join(names)}")


def _title_of(island: Box) -> Box:
    return Box(island.x, island.y, island.width, TITLE)


def _legend(image: Element, kinds: Collection[str], size: Box, note: str) -> float:
    """Draws a sample of each kind of line below the picture, and the note; returns the new lower edge."""
    group = SubElement(image, "g", {"class": "legend"})
    x, y = _EDGE, size.bottom
    for kind in (kind for kind in _LEGEND if kind in kinds):
        look, words = _LEGEND[kind]
        wide = 60 + _PER_CHARACTER["detail"] * len(words)
        if x > _EDGE and x + wide > size.width:
            x, y = _EDGE, y + _ROW
        _path(group, look, f"M{x:g} {y + 6:g}h32")
        _text(group, "detail", (x + 40, y + 10), words, wide)
        x += wide
    if note:
        y += _ROW
        _text(group, "detail", (_EDGE, y + 10), note, size.width)
    return y + _ROW


def _rect(group: Element, look: str, box: Box, radius: float) -> None:
    SubElement(
        group,
        "rect",
        {
            "class": look, "x": f"{box.x:g}", "y": f"{box.y:g}", "width": f"{box.width:g}",
            "height": f"{box.height:g}", "rx": f"{radius:g}",
        },
    )  # fmt: skip


def _path(group: Element, look: str, path: str, edge: Edge | None = None) -> Element:
    ends = {"data-from": edge.start, "data-to": edge.end} if edge else {}
    return SubElement(group, "path", {"class": look, "d": path, **ends})


def _text(group: Element, look: str, place: tuple[float, float], text: str, width: float) -> None:
    """A line of text, cut at a ``width`` in px; the title of its group has all of it."""
    x, y = place
    most = max(1, int(width / _PER_CHARACTER[look]))
    shown = printable(text)
    shown = shown if len(shown) <= most else shown[: most - 1] + "…"
    SubElement(group, "text", {"class": look, "x": f"{x:g}", "y": f"{y:g}"}).text = shown
