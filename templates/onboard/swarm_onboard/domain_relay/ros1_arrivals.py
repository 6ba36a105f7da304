"""What comes from an island of ROS 1: a subscription for each publisher, which a node here repeats."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any, Callable, Mapping, Sequence

from swarm_onboard.common.xmlrpc import PeerError
from swarm_onboard.domain_relay import publishers as known
from swarm_onboard.domain_relay.config import Config, Crossing
from swarm_onboard.domain_relay.domains import DEPTH, Home, message_class
from swarm_onboard.domain_relay.ros1_subscriber import Opened, Subscription, Take
from swarm_onboard.multimaster import config as multimaster
from swarm_onboard.multimaster import reconcile
from swarm_onboard.multimaster.graph import Entry, Graph
from swarm_onboard.multimaster.peer_state import Refusal
from swarm_onboard.ros.latched import Latched
from swarm_onboard.ros2 import ros1_bytes


class Arrivals:
    """The topics ``receives`` of ``peer``, by name; ``sums``: MD5 sums by type."""

    def __init__(
        self, config: Config, peer: multimaster.Peer, receives: Mapping[str, Crossing],
        sums: Mapping[str, str], home: Home,
    ) -> None:  # fmt: skip
        self._config, self._peer, self._home = config, peer, home
        self._receives, self._sums = receives, sums
        self._latched: dict[str, Latched] = {}
        self._subscriptions: dict[Entry, tuple[Subscription, asyncio.Future[None]]] = {}

    def follow(self, graph: Graph) -> tuple[str, ...]:
        """Starts and ends subscriptions; returns a line for each publisher that is refused."""
        address = self._config.address
        theirs = frozenset(
            (one.topic, one.node) for one in graph.entries if reconcile.host_of(one.uri) != address
        )
        # The type at the master is that of any node: a subscription sees that of its publisher.
        offer = reconcile.offer_of(self._peer, replace(graph, publishers=theirs, types={}))
        entries = {one for one in offer.entries if known.is_valid(one.node)}
        for topic in self._receives:
            self._latched.setdefault(topic, Latched([one.node for one in entries if one.topic == topic]))
        for entry in set(self._subscriptions) - entries:
            self._subscriptions.pop(entry)[1].cancel()
        for entry in entries - set(self._subscriptions):
            kind = self._receives[entry.topic].type
            made = Subscription(self._config.node, entry, self._peer.hosts, kind, self._sums[kind])
            self._subscriptions[entry] = made, asyncio.ensure_future(made.run(self._opener(entry)))
        nameless = [(one, "no node of ROS 2 can have its name") for one in sorted(offer.entries - entries)]
        refused: list[tuple[Entry | Refusal, str]] = [*nameless, *((one, one.why) for one in offer.refusals)]
        return tuple(f"{one.topic} of {one.node}: {why}" for one, why in refused)

    def senders(self) -> dict[str, list[str]]:
        """The nodes from which each topic comes."""
        found = list(self._subscriptions.items())
        return {
            topic: sorted(entry.node for entry, (one, _) in found if entry.topic == topic and one.connected)
            for topic in self._receives
        }

    def problems(self) -> tuple[dict[str, str], list[str]]:
        """Publishers whose type differs, with both types; and lines about others that fail."""
        found = list(self._subscriptions.items())
        lines = [(f"{entry.topic} of {entry.node}", one) for entry, (one, _) in found if one.problem]
        unfit = {name: one.problem for name, one in lines if one.differs}
        return unfit, [f"{name}: {one.problem}" for name, one in lines if not one.differs]

    def _opener(self, entry: Entry) -> Opened:
        crossing, latched = self._receives[entry.topic], self._latched[entry.topic]

        def opened(latching: bool) -> tuple[Take, Callable[[], None]]:
            quality, connection = known.Quality(reliable=True, latched=latching), object()
            publisher = self._home.publisher(entry.node, message_class(crossing.type), crossing, quality)

            def take(bodies: Sequence[bytes]) -> None:
                if crossing.command and latching:
                    bodies = [one for one in bodies if not latched.repeats(entry.node, connection)]
                for body in bodies[-1 if crossing.command else -DEPTH :]:
                    publisher.publish(_decoded(crossing.type, body))

            return take, lambda: self._home.remove(entry.node, publisher)

        return opened


def _decoded(kind: str, body: bytes) -> Any:
    try:
        return ros1_bytes.decode(kind, body)
    except ValueError as error:
        raise PeerError(str(error)) from error
