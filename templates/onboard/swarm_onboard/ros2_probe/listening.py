"""Counts the messages of the measured topics, each by its publisher."""

from __future__ import annotations

import time
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, Callable

from swarm_onboard.agent.observations import NodeSeen, Status, TopicSeen, worst
from swarm_onboard.agent.texts import clipped
from swarm_onboard.common.flow import Flow

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Request
    from swarm_onboard.ros2_probe.endpoints import Graph

_CONNECTS = 1.5  # s until a new subscription receives the first message, beside the window
_LARGEST_FLOW = 32 << 20  # bytes of one topic after which a measurement ends early
_FOR_A_RATE = 2  # messages
_OF_A_SLOW_ONE = 3  # messages within its window, two and a half periods; with the last, this ends early
_MOST = 0.75  # of a window
_DEPTH = 100
_DIAGNOSTICS = "/diagnostics"
_GID = 16  # bytes that are significant; Humble pads to 24
_MOST_STATUSES, _MOST_VALUES, _LONGEST_KEY = 8, 40, 40


class _Received(Flow):
    """The messages of one publisher. ``size``: bytes of them; ``due``: until when they are counted."""

    def __init__(self, seconds: float, kind: str, began: float) -> None:
        super().__init__(seconds)
        self.type, self.began, self.due = kind, began, began + seconds + _CONNECTS
        self.size = 0
        self.done: float | None = None

    def add(self, now: float, size: int) -> None:
        """Counts a message of ``size`` bytes. The window begins with the first."""
        if self.done is None:
            if not self.count:
                self.began, self.due = now, now + self.seconds
            self.tick(now)
            self.size += size
            if self.size > _LARGEST_FLOW and self.count >= _FOR_A_RATE:
                self.due = now
                self.seconds = min(self.seconds, now - self.began)
            if self.count == _OF_A_SLOW_ONE and now >= self.began + _MOST * self.seconds:
                self.due = now


class Listening:
    """Subscribes ``node`` to the topics of a request as soon as their publishers are known.

    ``subscribe`` is ``swarm_onboard.ros2.senders.subscribe_with_sender``, which an agent cannot import.

    ``troubles``: the types that this host lacks.
    """

    def __init__(
        self, request: Request, node: Any, longest: float, subscribe: Callable[..., Callable[[], None]]
    ) -> None:
        self._node = node
        self._subscribe_with_sender = subscribe
        self._wanted = {
            (node, topic): min(seconds, longest)
            for node, topics in request.nodes.items()
            for topic, seconds in topics.items()
            if seconds > 0
        }
        self._named = set(request.nodes)
        self._launched = {
            topic: min(seconds, longest)
            for topics in request.launched.values()
            for topic, seconds in topics.items()
            if seconds > 0
        }
        self._flows: dict[tuple[str, str], _Received] = {}
        self._subscriptions: dict[str, Callable[[], None]] = {}
        self._names: dict[bytes, str] = {}
        self._statuses: dict[str, dict[str, Status]] = {}
        self.lacking: dict[str, str] = {}

    @property
    def running(self) -> bool:
        """Whether some topic is still measured."""
        return any(one.done is None for one in self._flows.values())

    def begin(self, graph: Graph, now: float) -> None:
        """Subscribes to what has been found since the last call."""
        for one in graph.publishers:
            self._names[one.gid[:_GID]] = one.node
            key = one.node, one.topic
            seconds = self._wanted.get(key, 0.0)
            if one.node not in self._named:
                seconds = self._launched.get(one.topic, 0.0)
            if seconds and key not in self._flows and self._subscribe(one.topic, one.type):
                self._flows[key] = _Received(seconds, clipped(one.type), now)

    def _subscribe(self, topic: str, kind: str) -> bool:
        """Returns False if this host has no such type."""
        if kind in self.lacking:
            return False
        if topic not in self._subscriptions:
            try:
                message = message_class(kind)
            except Exception as error:  # noqa: BLE001  whatever is wrong with a package of the host
                self.lacking[kind] = clipped(error)
                return False
            # It asks for nothing, so that every publisher may connect.
            qos = import_module("rclpy.qos")
            quality = qos.QoSProfile(depth=_DEPTH, reliability=qos.ReliabilityPolicy.BEST_EFFORT)
            raw = topic != _DIAGNOSTICS
            self._subscriptions[topic] = self._subscribe_with_sender(
                self._node, message, topic, partial(self._take, topic), quality, raw=raw
            )
        return True

    def _take(self, topic: str, message: Any, gid: bytes, _sent: int, _arrived: int) -> None:
        now = time.monotonic()
        sender = self._names.get(gid, "a node that nobody has announced")
        size = len(message) if isinstance(message, bytes) else 0
        for (node, name), flow in self._flows.items():
            if name == topic and sender == node:
                flow.add(now, size)
        if topic == _DIAGNOSTICS:
            statuses = self._statuses.setdefault(sender, {})
            statuses.update((str(one.name), _status(one)) for one in message.status)

    def end(self, now: float, *, all_: bool = False) -> None:
        """Ends what has been measured for long enough."""
        for flow in self._flows.values():
            if flow.done is None and (now >= flow.due or all_):
                flow.done = now
        measured = {topic for (_, topic), flow in self._flows.items() if flow.done is None}
        for topic in [one for one in self._subscriptions if one not in measured]:
            self._subscriptions.pop(topic)()

    def measured(self, name: str, node: NodeSeen) -> NodeSeen:
        """Returns a node with what was measured of it."""
        now = time.monotonic()
        topics = {
            topic: _topic(flow, now if flow.done is None else flow.done)
            for (one, topic), flow in self._flows.items()
            if one == name
        }
        statuses = list(self._statuses.get(name, {}).values())[:_MOST_STATUSES]
        return node._replace(topics=topics, report=worst(statuses))


def message_class(kind: str) -> Any:
    """Returns the class of ``nav_msgs/msg/Odometry``. Raises any error if this host has none."""
    package, _, name = kind.partition("/msg/")
    return getattr(import_module(f"{package}.msg"), name)


def _topic(flow: _Received, now: float) -> TopicSeen:
    return TopicSeen(flow.count, flow.rate(now), flow.seconds, flow.type, age=flow.age(now))


def _status(one: Any) -> Status:
    values = ((clipped(pair.key, _LONGEST_KEY), clipped(pair.value)) for pair in one.values[:_MOST_VALUES])
    level = one.level[0] if isinstance(one.level, bytes) else int(one.level)
    return Status(level, clipped(one.name), clipped(one.message), dict(values))
