"""Which publishers of a topic are brought to another island, and with which quality. Knows no ROS."""

from __future__ import annotations

import re
from collections import OrderedDict
from dataclasses import dataclass
from typing import Collection, Iterable

GID_BYTES = 16  # that are significant; Humble pads to 24
_PREFIX = 12  # bytes of a GID that all endpoints of a participant share (DDSI-RTPS 2.5, 9.3.1)
_MOST_UNNAMED, _MOST_NAMED, _MOST_REMEMBERED = 8, 64, 1024
_NODE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*){1,20}", re.ASCII)
_LONGEST = 200
RELAY = "multimaster_"  # begins the node name of each relay


@dataclass(frozen=True)
class Publisher:
    """A publisher in the graph: its GID, the full name of its node, and what it offers."""

    gid: bytes
    node: str
    reliable: bool
    latched: bool


@dataclass(frozen=True)
class Quality:
    """What a subscription requests: as much as all publishers offer."""

    reliable: bool
    latched: bool


def relays(publishers: Iterable[tuple[bytes, str]]) -> frozenset[bytes]:
    """Returns the participants of relays, given GID and node name of all publishers of diagnostics."""
    return frozenset(gid[:_PREFIX] for gid, name in publishers if name.rpartition("/")[2].startswith(RELAY))


def of_island(publishers: Iterable[Publisher], brought: frozenset[bytes]) -> list[Publisher]:
    """Returns the publishers that run on the island itself: what a relay has brought goes no further."""
    return [one for one in publishers if one.gid[:_PREFIX] not in brought]


def named(publishers: Iterable[Publisher], before: Collection[str]) -> dict[bytes, str]:
    """Returns the nodes of publishers, by GID: those with a valid name, and of a flood of nodes a part.

    ``before``: nodes that were among them, which no flood drives out.
    """
    found = {one.gid: one.node for one in publishers if is_valid(one.node)}
    kept = sorted(set(found.values()), key=lambda node: (node not in before, node))[:_MOST_NAMED]
    return {gid: node for gid, node in found.items() if node in kept}


def is_valid(node: str) -> bool:
    """Returns whether a node of ROS 2 can have this full name."""
    return len(node) <= _LONGEST and _NODE.fullmatch(node) is not None


def quality(publishers: Iterable[Publisher]) -> Quality:
    """Returns what a subscription can request of all ``publishers``."""
    found = list(publishers)
    return Quality(all(one.reliable for one in found), all(one.latched for one in found))


class Names:
    """The nodes of publishers, by GID. Fast DDS 2 finds publishers again that were away for longer than its
    lease, but gives their names to the graph no second time.
    """

    def __init__(self) -> None:
        self._names: OrderedDict[bytes, str] = OrderedDict()

    def of(self, gid: bytes, node: str) -> str:
        """Returns the node of a publisher. ``node``: as the graph has it; empty if it does not name it."""
        if node:
            self._names[gid] = node
        if gid in self._names:
            self._names.move_to_end(gid)
        while len(self._names) > _MOST_REMEMBERED:
            self._names.popitem(last=False)
        return self._names.get(gid, "")


class Unnamed:
    """The last message of each publisher whose node the graph does not name yet."""

    def __init__(self) -> None:
        self._kept: dict[bytes, bytes] = {}

    def keep(self, gid: bytes, message: bytes) -> None:
        """Keeps a message of one of a few publishers."""
        if gid in self._kept or len(self._kept) < _MOST_UNNAMED:
            self._kept[gid] = message

    def taken(self, gid: bytes) -> list[bytes]:
        """Returns what was kept of a publisher, and forgets it."""
        return [self._kept.pop(gid)] if gid in self._kept else []

    def forget_others(self, gids: Iterable[bytes]) -> None:
        """Forgets the publishers that are not among ``gids``."""
        known = set(gids)
        self._kept = {gid: one for gid, one in self._kept.items() if gid in known}
