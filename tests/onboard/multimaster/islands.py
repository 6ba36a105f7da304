"""Islands in memory: masters and the real bridge of each, stepped by the test on a simulated clock."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from swarm_onboard.common.xmlrpc import Names, PeerError
from swarm_onboard.multimaster import config, rpc
from swarm_onboard.multimaster.bridge import Bridge
from swarm_onboard.multimaster.diagnostics import TOPIC as DIAGNOSTICS

from tests.onboard.multimaster.masters import Rosmaster, reply

SILENT, REMOVE = 3.0, 30.0
KIND = "std_msgs/String"

#: The topics that an island receives from each peer: island, peer, topics.
Wiring = Mapping[str, Mapping[str, Sequence[str]]]


def address(island: str) -> str:
    return f"10.0.0.{ord(island[-1])}"


def master_uri(island: str) -> str:
    return f"http://{address(island)}:11311"


def sync_node(island: str) -> str:
    return f"/multimaster_{island}"


def parameters(wiring: Wiring, island: str, kinds: Mapping[str, str] | None = None) -> dict[str, Any]:
    """The parameter file of ``island``, as swarmctl writes it."""
    return {
        "island": island,
        "node": sync_node(island),
        "master": master_uri(island),
        "address": address(island),
        "poll_hz": 1.0,
        "silent_after": SILENT,
        "remove_after": REMOVE,
        "peers": [
            {
                "island": peer,
                "master": master_uri(peer),
                "hosts": [address(peer)],
                "receives": [{"topic": topic, "type": (kinds or {}).get(topic, KIND)} for topic in topics],
            }
            for peer, topics in wiring[island].items()
        ],
    }


@dataclass
class World:
    """All islands of ``wiring``. A step is one poll of everything, in a fixed order."""

    wiring: Wiring
    now: float = 1000.0
    port: int = 40000
    masters: dict[str, Rosmaster] = field(default_factory=dict)
    bridges: dict[str, Bridge | None] = field(default_factory=dict)
    uris: dict[str, str] = field(default_factory=dict)  # of the bridges
    cut: set[frozenset[str]] = field(default_factory=set)

    def __post_init__(self) -> None:
        for island in self.wiring:
            self.masters[island] = Rosmaster()
            self.start_bridge(island)

    def uri(self, island: str) -> str:
        self.port += 1
        return f"http://{address(island)}:{self.port}/"

    def start_bridge(self, island: str, wiring: Wiring | None = None) -> None:
        self.uris[island] = self.uri(island)
        settings = config.parse(parameters(wiring or self.wiring, island))
        self.bridges[island] = Bridge(settings, self.uris[island], lambda: self.now)

    def restart_master(self, island: str) -> None:
        self.masters[island] = Rosmaster()

    def exchange_from(self, island: str) -> Any:
        """The function that replaces the network while the bridge of ``island`` runs."""
        places = {master_uri(name): name for name in self.wiring}

        async def exchange(uri: str, calls: Sequence[Any], seconds: float, _names: Names) -> bytes:
            there = places[uri]
            if frozenset({island, there}) in self.cut:
                raise PeerError(f"no answer within {seconds:g} s")
            return reply(self.masters[there], calls)

        return exchange

    def act(self, island: str, what: Coroutine[Any, Any, Any]) -> Any:
        before, rpc.exchange = rpc.exchange, self.exchange_from(island)
        try:
            return asyncio.run(what)
        finally:
            rpc.exchange = before

    def step(self, seconds: float = 1.0) -> None:
        self.now += seconds
        for island, bridge in self.bridges.items():
            if bridge:
                self.act(island, self._round(bridge))

    @staticmethod
    async def _round(bridge: Bridge) -> None:
        for peer in bridge.config.peers:
            await bridge.visit(peer)
        await bridge.settle()

    def stop_bridge(self, island: str) -> None:
        bridge, self.bridges[island] = self.bridges[island], None
        if bridge:
            self.act(island, bridge.unregister_all())

    def publish(self, island: str, node: str, topic: str, kind: str = KIND, uri: str = "") -> str:
        """Register a publisher at the master of ``island``; returns its URI, a new one unless given."""
        uri = uri or self.uri(island)
        self.masters[island].registerPublisher(node, topic, kind, uri)
        return uri

    def brought(self, island: str) -> set[tuple[str, str]]:
        """Topics and nodes at the island's master that other hosts publish."""
        return {
            (topic, node)
            for topic, node, uri in self.masters[island].publishers()
            if f"//{address(island)}:" not in uri
        }

    def own(self, island: str) -> set[tuple[str, str, str]]:
        """Publishers of the island's own nodes, without its bridge."""
        return {
            entry
            for entry in self.masters[island].publishers()
            if f"//{address(island)}:" in entry[2] and entry[0] != DIAGNOSTICS
        }
