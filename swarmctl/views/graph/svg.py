"""A swarm as a picture, SVG: `swarmctl graph --format svg`, and what the page of `swarmctl ui` shows.

All lengths are in px, from the upper left corner.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from swarmctl.analysis.diagram import Diagram, Edge, Node
from swarmctl.plugins import LINK_KINDS
from swarmctl.resources import templates
from swarmctl.views.escape import printable

CARD = 230.0  # width of a host
HEADER = 46.0  # height of a host without robots and programs
PART = 40.0  # height of a robot or program
INDENT = 26.0  # of a robot or program in its host: here is its link
TITLE = 30.0  # height of an island's title
BAR = 30.0  # height of a network's bar
_GAP = 8.0
_MARGIN = 16.0
_TRUNK = 12.0  # between the lines of two networks beside a column
_MOST_COLUMNS = 6
_BESIDE = ("network", "commands", "data")  # edges of a host that lead to nothing that it runs or drives


@dataclass(frozen=True)
class Box:
    """A rectangle."""

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """The right edge."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """The lower edge."""
        return self.y + self.height


@dataclass(frozen=True)
class Trunk:
    """The line of a network down beside a column, from its bar at ``top``, and its ``taps``: (host, y)."""

    network: str
    x: float
    top: float
    taps: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Layout:
    """The boxes of islands by their names, and of everything else by the ids of the nodes."""

    size: Box
    islands: Mapping[str, Box]
    nodes: Mapping[str, Box]
    parts: Mapping[str, tuple[Edge, ...]]  # by a host's id: the edges to its robots and programs
    trunks: tuple[Trunk, ...]


@dataclass
class _Shelf:
    """Islands beside each other. ``used`` columns hold cards; ``bottom`` is the lowest edge."""

    top: float
    used: int = 0
    bottom: float = 0.0


def layout(diagram: Diagram) -> Layout:
    """Islands stand beside each other as far as the width goes; bars of networks run above all of them."""
    networks = [node.id for node in diagram.nodes if node.kind == "network"]
    parts = _parts(diagram)
    groups = _groups(diagram, parts)
    count = sum(len(hosts) for _, hosts in groups)
    columns = min(_MOST_COLUMNS, max(1, math.ceil(math.sqrt(1.2 * count))), max(1, count))
    gutter = 2 * _MARGIN + _TRUNK * len(networks)
    lefts = [gutter + column * (CARD + gutter) for column in range(columns)]
    width = lefts[-1] + CARD + gutter
    bars = {
        network: Box(_MARGIN, _MARGIN + row * (BAR + _GAP), width - 2 * _MARGIN, BAR)
        for row, network in enumerate(networks)
    }
    islands, cards, bottom = _placed(groups, parts, lefts, _MARGIN + len(bars) * (BAR + _GAP) + _GAP)
    boxes = dict(bars)
    for host, card in cards.items():
        boxes[host] = card
        for row, edge in enumerate(parts.get(host, ())):
            top = card.y + HEADER + row * (PART + _GAP)
            boxes[edge.end] = Box(card.x + INDENT, top, CARD - INDENT - _GAP, PART)
    trunks = tuple(_trunks(diagram, cards, bars, lefts))
    return Layout(Box(0, 0, width, bottom + _MARGIN), islands, boxes, parts, trunks)


def _parts(diagram: Diagram) -> dict[str, tuple[Edge, ...]]:
    """By host, the first edge to each robot and program that it drives or runs."""
    found: dict[str, list[Edge]] = {}
    seen: set[str] = set()
    for edge in diagram.edges:
        if edge.start.startswith("host:") and edge.kind not in _BESIDE and edge.end not in seen:
            seen.add(edge.end)
            found.setdefault(edge.start, []).append(edge)
    return {host: tuple(edges) for host, edges in found.items()}


def _groups(diagram: Diagram, parts: Mapping[str, Sequence[Edge]]) -> list[tuple[str, list[str]]]:
    """The islands with the ids of their hosts; under no name what no island has.

    What no host runs or drives stands as a host does.
    """
    below = {edge.end for edges in parts.values() for edge in edges}
    cards = [node for node in diagram.nodes if node.kind != "network" and node.id not in below]
    names = [name for name, _ in diagram.islands]
    groups = [(name, [card.id for card in cards if card.island == name]) for name in names]
    groups.append(("", [card.id for card in cards if card.island not in names]))
    return [(name, hosts) for name, hosts in groups if hosts]


def _placed(
    groups: Sequence[tuple[str, list[str]]],
    parts: Mapping[str, Sequence[Edge]],
    lefts: Sequence[float],
    top: float,
) -> tuple[dict[str, Box], dict[str, Box], float]:
    """The boxes of islands and of hosts, and the lowest edge."""
    islands: dict[str, Box] = {}
    cards: dict[str, Box] = {}
    shelf = _Shelf(top, bottom=top)
    for name, hosts in groups:
        columns = min(len(hosts), len(lefts))
        if shelf.used + columns > len(lefts):
            shelf = _Shelf(shelf.bottom + _MARGIN, bottom=shelf.bottom + _MARGIN)
        mine = lefts[shelf.used : shelf.used + columns]
        lowest = dict.fromkeys(mine, shelf.top + TITLE)
        for host in hosts:
            left = min(mine, key=lambda x: (lowest[x], x))
            below = len(parts.get(host, ()))
            cards[host] = Box(left, lowest[left], CARD, HEADER + below * (PART + _GAP))
            lowest[left] = cards[host].bottom + _MARGIN
        bottom = max(lowest.values())
        islands[name] = Box(
            mine[0] - _GAP, shelf.top, mine[-1] + CARD + 2 * _GAP - mine[0], bottom - shelf.top - _GAP
        )
        shelf.used += columns
        shelf.bottom = max(shelf.bottom, bottom)
    return islands, cards, shelf.bottom


def _trunks(
    diagram: Diagram, cards: Mapping[str, Box], bars: Mapping[str, Box], lefts: Sequence[float]
) -> Iterator[Trunk]:
    """The lines of each network, in the gaps to the left of the columns; a tap for each host on it."""
    rows = dict(zip(bars, accumulate([_TRUNK] * len(bars)), strict=True))
    for network, bar in bars.items():
        members = [edge.start for edge in diagram.edges if edge.kind == "network" and edge.end == network]
        for left in lefts:
            taps = tuple(
                (host, cards[host].y + min(rows[network], HEADER - _GAP))
                for host in members
                if cards[host].x == left
            )
            if taps:
                yield Trunk(network, left - _GAP - rows[network], bar.bottom, taps)


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
