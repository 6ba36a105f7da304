"""Random events on islands, drawn from a seed, and a model of the registrations that must result."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from tests.onboard.multimaster.many_islands import ISLANDS, sync_node

#: Topics that one island publishes for the others, and topics that all islands publish.
OWN = {island: tuple(f"/{island}/topic{number}" for number in range(9)) for island in ISLANDS}
COMMON = ("/common/one", "/common/two", "/common/three")
#: Published, but not declared.
STRAY = ("/stray/one", "/stray/two")
NODES = 7  # names per island; the last is the same on all islands
RECEIVES = {here: {there: (*OWN[there], *COMMON) for there in ISLANDS if there != here} for here in ISLANDS}

Event = tuple[Any, ...]


@dataclass
class Node:
    """What a node has registered at its master. ``uri`` is set when it starts."""

    publishes: set[str]
    subscribes: set[str]
    uri: str = ""


@dataclass
class Model:
    """What the nodes of each island have registered at their own master."""

    nodes: dict[str, dict[str, Node]] = field(default_factory=lambda: {island: {} for island in ISLANDS})

    def publishers(self, island: str) -> set[tuple[str, str, str]]:
        """Topic, node and URI of each publisher of the island's own nodes."""
        return {
            (topic, name, node.uri) for name, node in self.nodes[island].items() for topic in node.publishes
        }

    def subscribers(self, island: str) -> set[tuple[str, str]]:
        """Topic and node of each subscriber that the island's master must have."""
        own = {(topic, name) for name, node in self.nodes[island].items() for topic in node.subscribes}
        return own | {
            (topic, sync_node(there))
            for there, received in RECEIVES.items()
            for topic in received.get(island, ())
        }

    def offered(self, island: str) -> list[set[tuple[str, str, str]]]:
        """The publishers that each peer offers to ``island``, without node names in use there."""
        taken = self.nodes[island]
        return [
            {entry for entry in self.publishers(peer) if entry[0] in topics and entry[1] not in taken}
            for peer, topics in RECEIVES[island].items()
        ]


def events(seed: int, count: int) -> Iterator[Event]:
    """``count`` events; the same for the same seed."""
    chance = random.Random(seed)
    running: dict[str, set[str]] = {island: set() for island in ISLANDS}
    publishing: dict[tuple[str, str], set[str]] = {}
    kinds = {"start": 30, "add": 22, "drop": 18, "stop": 12, "die": 4, "cut": 5, "heal": 4,
             "restart master": 1, "kill sync": 2, "stop sync": 2}  # fmt: skip
    for _ in range(count):
        kind = chance.choices(tuple(kinds), tuple(kinds.values()))[0]
        island = chance.choice(ISLANDS)
        nodes = sorted(running[island])
        if kind in ("add", "drop", "stop", "die") and not nodes:
            kind = "start"
        if kind == "start":
            number = chance.randrange(NODES)
            name = "/shared" if number == NODES - 1 else f"/{island}/node{number}"
            publishes = chance.sample((*OWN[island], *COMMON, *STRAY), chance.randint(1, 6))
            subscribes = chance.sample([topic for topics in RECEIVES[island].values() for topic in topics], 2)
            running[island].add(name)
            publishing[island, name] = set(publishes)
            yield kind, island, name, publishes, sorted(set(subscribes))
        elif kind == "add":
            name = chance.choice(nodes)
            topic = chance.choice((*OWN[island], *COMMON, *STRAY))
            publishing[island, name].add(topic)
            yield kind, island, name, topic
        elif kind == "drop":
            name = chance.choice(nodes)
            topic = chance.choice(sorted(publishing[island, name]) or [STRAY[0]])
            publishing[island, name].discard(topic)
            yield kind, island, name, topic
        elif kind == "stop":
            name = chance.choice(nodes)
            running[island].discard(name)
            yield kind, island, name
        elif kind == "die":
            yield kind, island, chance.choice(nodes)
        elif kind == "cut":
            yield kind, *chance.sample(ISLANDS, 2)
        elif kind == "heal":
            yield (kind,)
        else:
            if kind == "restart master":
                running[island].clear()
            yield kind, island
