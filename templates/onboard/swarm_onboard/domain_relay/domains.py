"""The relay in domains of ROS 2: a subscription for each topic that crosses, a publisher for each sender.

A topic is published by nodes that have the names of those on the other island, so that whoever decides
by the sender's name, as a robot's driver does, decides there as here.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from importlib import import_module
from typing import Any, Callable, Iterable, Iterator, Mapping, Protocol, Sequence

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from swarm_onboard.domain_relay import publishers as known
from swarm_onboard.domain_relay.config import Config, Crossing, Peer
from swarm_onboard.domain_relay.delays import Delays
from swarm_onboard.domain_relay.peer_state import PeerState
from swarm_onboard.ros2.late import Late
from swarm_onboard.ros2.senders import full_name, subscribe_with_sender

DIAGNOSTICS = "/diagnostics"
EXPIRES = 0.5  # s after which a network drops a command: a robot's dead-man would have stopped it
LOOK_EVERY = 0.2  # s between two looks at the publishers of a domain
DEPTH = 10
_NAMELESS = "_NODE_NAME_UNKNOWN_"


@contextlib.contextmanager
def environment(variables: Mapping[str, str]) -> Iterator[None]:
    """The environment of this process has ``variables`` meanwhile."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def context_of(domain: int) -> Any:
    """Returns a new context in a domain."""
    made = rclpy.Context()
    rclpy.init(context=made, domain_id=domain)
    return made


def node_in(context: Any, full: str) -> Any:
    """Returns a new node that publishes and subscribes to nothing of its own."""
    space, _, name = full.rpartition("/")
    return rclpy.create_node(
        name, namespace=space or "/", context=context, start_parameter_services=False, enable_rosout=False
    )


def profile_of(command: bool, quality: known.Quality) -> QoSProfile:
    """Returns with which quality a topic crosses."""
    profile = QoSProfile(depth=1 if command else DEPTH)
    profile.reliability = ReliabilityPolicy.RELIABLE if quality.reliable else ReliabilityPolicy.BEST_EFFORT
    if quality.latched:
        profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    if command:
        profile.lifespan = Duration(seconds=EXPIRES)
    return profile


def message_class(kind: str) -> Any:
    """Returns the class of a message type such as ``geometry_msgs/Twist``; None if this host lacks it."""
    package, _, name = kind.partition("/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError):
        return None


def node_of(publisher: Any, names: known.Names) -> str:
    """Returns the full name of the node of a publisher in the graph; empty if nobody has named it."""
    unknown = publisher.node_name == _NAMELESS
    name = "" if unknown else full_name(publisher.node_namespace, publisher.node_name)
    return names.of(bytes(publisher.endpoint_gid)[: known.GID_BYTES], name)


class Island(Protocol):
    """Where a topic is published, by nodes with the names of its senders elsewhere."""

    def publisher(self, sender: str, message: Any, crossing: Crossing, quality: known.Quality) -> Any:
        """Returns a new publisher of the node with this full name."""

    def remove(self, sender: str, publisher: Any) -> None:
        """Removes a publisher, and its node if it has no other one."""


class Home:
    """The domain of the own island: nodes with the names of senders elsewhere, while they publish."""

    def __init__(self, config: Config) -> None:
        self.context = context_of(config.domain)
        self.node = node_in(self.context, config.node)
        self._lock = threading.Lock()
        self._nodes: dict[str, tuple[Any, int]] = {}  # with the number of their publishers

    def publisher(self, sender: str, message: Any, crossing: Crossing, quality: known.Quality) -> Any:
        """Returns a new publisher of the node with this full name."""
        profile = profile_of(crossing.command, quality)
        with self._lock:
            node, count = self._nodes.get(sender) or (node_in(self.context, sender), 0)
            self._nodes[sender] = node, count + 1
        return node.create_publisher(message, crossing.topic, profile)

    def remove(self, sender: str, publisher: Any) -> None:
        """Removes a publisher, and its node if it has no other one."""
        with self._lock:
            node, count = self._nodes.pop(sender)
            node.destroy_publisher(publisher)
            if count > 1:
                self._nodes[sender] = node, count - 1
            else:
                node.destroy_node()


class Topic:
    """A topic in the domain of ``source``, and its publishers on the island to which it goes."""

    def __init__(
        self, crossing: Crossing, message: Any, source: Any, target: Island, names: known.Names
    ) -> None:
        self.name, self._crossing, self._message = crossing.topic, crossing, message
        self._command, self._source, self._target = crossing.command, source, target
        self._late, self._unnamed, self.delays = Late(EXPIRES), known.Unnamed(), Delays()
        self._known = names
        self._names: dict[bytes, str] = {}
        self._here: dict[str, Any] = {}  # publishers by sender
        self._quality: known.Quality | None = None
        self._end: Callable[[], None] = lambda: None

    @property
    def senders(self) -> list[str]:
        """The nodes that publish it."""
        return sorted(self._here)

    def look(self, brought: Any) -> None:
        """Follows its publishers. ``brought``: the participants of relays there."""
        found = known.of_island(self._publishers(), brought)
        self._names = known.named(found, self._here)
        wanted, quality = set(self._names.values()), known.quality(found)
        if found and quality != self._quality:
            self._subscribe(quality)
        for sender in wanted.difference(self._here):
            self._here[sender] = self._target.publisher(sender, self._message, self._crossing, quality)
        for sender in set(self._here).difference(wanted):
            self._target.remove(sender, self._here.pop(sender))
        for gid, sender in self._names.items():
            for message in self._unnamed.taken(gid):
                self._here[sender].publish(message)
        self._unnamed.forget_others(one.gid for one in found)

    def _publishers(self) -> list[known.Publisher]:
        return [
            known.Publisher(
                bytes(one.endpoint_gid)[: known.GID_BYTES],
                node_of(one, self._known),
                one.qos_profile.reliability == ReliabilityPolicy.RELIABLE,
                one.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL,
            )
            for one in self._source.get_publishers_info_by_topic(self.name)
        ]

    def _subscribe(self, quality: known.Quality) -> None:
        self._end()
        for sender in list(self._here):  # their quality changes, too
            self._target.remove(sender, self._here.pop(sender))
        self._quality, profile = quality, profile_of(self._command, quality)
        self._end = subscribe_with_sender(
            self._source, self._message, self.name, self._received, profile, raw=True
        )

    def _received(self, message: bytes, gid: bytes, sent: int, arrived: int) -> None:
        """Times in ns, each by the clock of its host."""
        if self._command:
            late = self._late.is_late(gid, sent * 1e-9, arrived * 1e-9)
            self.delays.add(time.monotonic(), self._late.lag, dropped=late)
            if late:
                return
        publisher = self._here.get(self._names.get(gid, ""))
        if publisher is not None:
            publisher.publish(message)
        elif not self._command:
            self._unnamed.keep(gid, message)


class Domain:
    """A domain with topics that go elsewhere, in a thread of its own."""

    def __init__(self, node: Any, topics: Sequence[Topic], names: known.Names) -> None:
        self._node, self._topics, self._names = node, topics, names
        self.nodes = 0  # of islands, as the graph names them; else those that publish what goes elsewhere
        self.looked = time.monotonic()
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)
        node.create_timer(LOOK_EVERY, self._look)
        threading.Thread(target=self._spin, name=node.get_name(), daemon=True).start()

    def _look(self) -> None:
        infos = self._node.get_publishers_info_by_topic(DIAGNOSTICS)
        brought = known.relays((bytes(one.endpoint_gid), node_of(one, self._names)) for one in infos)
        for topic in self._topics:
            topic.look(brought)
        names = (name for name, _ in self._node.get_node_names_and_namespaces())
        named = sum(not name.startswith(known.RELAY) for name in names)
        self.nodes = named or sum(len(one.senders) for one in self._topics)
        self.looked = time.monotonic()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()


class Away:
    """Another island of ROS 2, and the topics that come from it."""

    def __init__(self, config: Config, peer: Peer, home: Home) -> None:
        self._island = peer.island
        with environment(peer.environment):  # which DDS reads for each domain
            node = node_in(context_of(peer.domain), config.node)
        names = known.Names()
        self.topics, self._unfit = topics_of(peer.receives, node, home, names)
        self.domain = Domain(node, self.topics, names)

    def state(self) -> PeerState:
        """The state of the peer now."""
        problem = "" if self.domain.nodes else "no node is seen"
        return PeerState(
            self._island, problem, self._unfit, (), {one.name: one.senders for one in self.topics}
        )


def topics_of(
    crossings: Iterable[Crossing], source: Any, target: Island, names: known.Names
) -> tuple[list[Topic], dict[str, str]]:
    """Returns the topics that can cross, and what is wrong with the others."""
    found = {one: message_class(one.type) for one in crossings}
    lacking = {one.topic: f"this host lacks {one.type}" for one, kind in found.items() if kind is None}
    fit = [(one, kind) for one, kind in found.items() if kind is not None]
    return [Topic(one, kind, source, target, names) for one, kind in fit], lacking
