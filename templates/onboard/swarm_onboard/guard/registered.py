"""What is registered at the master through the guard, by the master's own rules. No clock, no I/O.

A node has one URI; a registration from another URI replaces the node (rosmaster 1.15, registrations.py).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Tuple

PUBLISHES, SUBSCRIBES, SERVES, WATCHES = "publishes", "subscribes to", "serves", "watches"
Entry = Tuple[str, str]  # one of these, and a topic, service or parameter


@dataclass
class Node:
    """A node at its URI, registered by ``host``. ``entries`` have the URI for each."""

    uri: str
    host: str
    entries: dict[Entry, str] = field(default_factory=dict)


class Registered:
    """The nodes by name."""

    def __init__(self) -> None:
        self.nodes: dict[str, Node] = {}
        self._counts: Counter[str] = Counter()
        self._publishers: Counter[tuple[str, str]] = Counter()

    def count(self, host: str) -> int:
        """How many registrations ``host`` has."""
        return self._counts[host]

    def publishers(self, host: str, topic: str) -> int:
        """How many nodes of ``host`` publish ``topic``."""
        return self._publishers[host, topic]

    def has(self, name: str, uri: str, entry: Entry) -> bool:
        """Whether the node ``name`` at ``uri`` is registered for that already."""
        node = self.nodes.get(name)
        return node is not None and node.uri == uri and entry in node.entries

    def add(self, name: str, uri: str, host: str, entry: Entry, at: str) -> None:
        """Counts a registration with the URI ``at``; a node of that name at another ``uri`` is forgotten."""
        node = self.nodes.get(name)
        if node is not None and node.uri != uri:
            for one in tuple(node.entries):
                self._drop(name, node, one)
            node = None
        if node is None:
            node = self.nodes[name] = Node(uri, host)
        if entry not in node.entries:
            self._count(node.host, entry, 1)
        node.entries[entry] = at

    def remove(self, name: str, entry: Entry, at: str) -> None:
        """Forgets a registration, if its URI is ``at``. A node that only watches parameters is forgotten: one
        of rospy does not say that it ends to watch them."""
        node = self.nodes.get(name)
        if node is not None and node.entries.get(entry) == at:
            self._drop(name, node, entry)
            if all(kind == WATCHES for kind, _ in node.entries):
                for one in tuple(node.entries):
                    self._drop(name, node, one)

    def _drop(self, name: str, node: Node, entry: Entry) -> None:
        del node.entries[entry]
        self._count(node.host, entry, -1)
        if not node.entries:
            del self.nodes[name]

    def _count(self, host: str, entry: Entry, change: int) -> None:
        kind, what = entry
        self._counts[host] += change
        if kind == PUBLISHES:
            self._publishers[host, what] += change
            if not self._publishers[host, what]:
                del self._publishers[host, what]
