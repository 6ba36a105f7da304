"""Publishes at a master of ROS 1 what nodes of ROS 2 publish, as nodes of the same names."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from typing import Any

from rclpy.serialization import deserialize_message

from swarm_onboard.common import slave
from swarm_onboard.common.slave import SlaveApi
from swarm_onboard.common.tcpros import Publication
from swarm_onboard.domain_relay.config import Config, Crossing
from swarm_onboard.domain_relay.domains import DEPTH
from swarm_onboard.domain_relay.ros1_subscriber import LARGEST_MESSAGE
from swarm_onboard.multimaster.graph import Entry
from swarm_onboard.ros2 import ros1_bytes

_MOST_WAITING = 1 << 20  # bytes


class Outgoing:
    """A topic of one node. Messages come in threads of rclpy, and go in that of the loop."""

    def __init__(
        self, loop: asyncio.AbstractEventLoop, sender: str, crossing: Crossing, md5sum: str, message: Any,
        *, latched: bool,
    ) -> None:  # fmt: skip
        self.sender, self.crossing, self.problem = sender, crossing, ""
        self._loop, self._message, self._latched = loop, message, latched
        self._bodies: deque[bytes] = deque(maxlen=1 if crossing.command else DEPTH)
        limit = LARGEST_MESSAGE if latched else 0 if crossing.command else _MOST_WAITING
        self.publication = Publication(
            sender, crossing.topic, crossing.type, md5sum, latching=latched, most_waiting=limit
        )

    def publish(self, serialised: bytes) -> None:
        """Sends a message, given as ROS 2 serialises it; drops it if nobody would get it."""
        if not (self._latched or self.publication.has_subscribers):
            return
        try:
            body = ros1_bytes.encode(deserialize_message(serialised, self._message))
        except Exception:  # noqa: BLE001  of rclpy, whatever garbage leads it to
            self.problem = f"a message is no {self.crossing.type}"
            return
        large = len(body) > LARGEST_MESSAGE
        self.problem = f"a message of {len(body) >> 20} MB is too large" if large else ""
        if large:
            return
        self._bodies.append(body)
        self._loop.call_soon_threadsafe(self._send)

    def _send(self) -> None:
        with contextlib.suppress(IndexError):  # newer ones have displaced it
            self.publication.publish(self._bodies.popleft())


class Nodes:
    """The nodes of ROS 2 that publish at the master of an island; ``wanted``: what they are to publish."""

    def __init__(self, config: Config, master: str) -> None:
        self.wanted: set[Outgoing] = set()
        self._config, self._master = config, master
        self._nodes: dict[str, Node] = {}

    @property
    def names(self) -> frozenset[str]:
        """The names of all nodes."""
        return frozenset(self._nodes)

    def entries(self) -> frozenset[Entry]:
        """What is to be registered at the master."""
        return frozenset(
            Entry(one.crossing.topic, name, node.uri)
            for name, node in self._nodes.items()
            for one in node.publishers
        )

    async def follow(self) -> None:
        """Starts and ends nodes and publishers. Raises OSError if no file descriptor is left."""
        for name, node in list(self._nodes.items()):
            for one in set(node.publishers) - self.wanted:
                node.remove(one)
            if not node.publishers:
                self._nodes.pop(name).close()
        for one in self.wanted.difference(self._publishers()):
            if one.sender == self._config.node:  # a stranger with the name of this relay
                continue
            if one.sender not in self._nodes:
                node = Node(self._master, self._config.address)
                await node.start()
                self._nodes[one.sender] = node
            await self._nodes[one.sender].add(one)

    def problems(self) -> list[str]:
        """Lines about what cannot be sent."""
        return [
            f"{one.crossing.topic} of {one.sender}: {one.problem}"
            for one in self._publishers()
            if one.problem
        ]

    def _publishers(self) -> list[Outgoing]:
        return [one for node in list(self._nodes.values()) for one in node.publishers]


class Node:
    """A node at a master, with a slave API of its own."""

    def __init__(self, master: str, address: str) -> None:
        self._master, self._address = master, address
        self._topics: dict[str, tuple[Outgoing, int]] = {}  # with its port
        self._api = SlaveApi()
        self.uri = ""

    @property
    def publishers(self) -> list[Outgoing]:
        """What it publishes."""
        return [one for one, _ in list(self._topics.values())]

    async def start(self) -> None:
        """Starts to answer."""
        self.uri = f"http://{self._address}:{await self._api.start()}/"

    async def add(self, publisher: Outgoing) -> None:
        """Publishes a further topic."""
        self._topics[publisher.crossing.topic] = publisher, await publisher.publication.start()
        kinds = {topic: one.crossing.type for topic, (one, _) in self._topics.items()}
        self._api.methods = slave.methods(self._master, kinds, self._offer, wake=lambda _topic: None)

    def remove(self, publisher: Outgoing) -> None:
        """Publishes a topic no more."""
        self._topics.pop(publisher.crossing.topic)
        publisher.publication.close()

    def close(self) -> None:
        """Answers no more."""
        self._api.close()

    def _offer(self, topic: str) -> list[Any]:
        return ["TCPROS", self._address, self._topics[topic][1]] if topic in self._topics else []
