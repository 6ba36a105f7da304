"""Where everything stands in the picture of a swarm: a card per host in its island, below its networks. Pure.

All lengths are in px, from the upper left corner.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

from swarmctl.analysis.diagram import Diagram, Edge

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
