"""As much of rclpy as the nodes of a driver and a gate touch, without a network (see fake_graph)."""

from __future__ import annotations

import queue
import threading
import time
from inspect import signature
from types import SimpleNamespace
from typing import Any

from fake_graph import Message, Stamp, listen, listeners, say


def init(args: list[str], signal_handler_options: Any) -> None:
    """Nothing to do: there is no network."""


def try_shutdown() -> None:
    say({"topic": "shutdown"})


def create_node(name: str, *, namespace: str, parameter_overrides: Any) -> Node:
    return Node(f"{namespace}/{name}")


class Node:
    """A node whose subscriptions get what stdin has; each sender is a publisher with a GID of its own."""

    context = SimpleNamespace(ok=lambda: True)

    def __init__(self, name: str) -> None:
        self._name = name
        self._parameters: dict[str, Any] = {}
        self._subscriptions: dict[str, Any] = {}
        self._kinds: dict[str, Any] = {}
        self._senders: list[str] = []
        self.waiting: queue.Queue[Any] = queue.Queue()

    def get_fully_qualified_name(self) -> str:
        return self._name

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: Stamp(time.time()))

    def resolve_topic_name(self, topic: str) -> str:
        return topic

    def create_publisher(self, kind: Any, topic: str, profile: Any) -> Publisher:
        return Publisher(topic)

    def destroy_publisher(self, publisher: Publisher) -> None:
        say({"topic": "no more", "name": publisher.topic})

    def create_timer(self, period: float, call: Any) -> None:
        """Everybody listens from the beginning."""

    def create_subscription(self, kind: Any, topic: str, take: Any, profile: Any, raw: bool = False) -> str:
        self._subscriptions[topic] = take
        self._kinds[topic] = kind
        if len(self._subscriptions) == 1:
            listen({}, lambda *what: self.waiting.put(what))
        say({"topic": "subscribes", "name": topic})
        return topic

    def destroy_subscription(self, topic: str) -> None:
        del self._subscriptions[topic]
        say({"topic": "no more", "name": topic})

    def destroy_node(self) -> None:
        """It ends with its process."""

    def deliver(self, topic: str, sender: str, message: Message | bytes) -> None:
        if sender not in self._senders:
            self._senders.append(sender)
        take = self._subscriptions[topic]
        if not isinstance(message, self._kinds[topic]):
            return
        if len(signature(take).parameters) == 1:
            take(message)
            return
        now = time.time_ns()
        gid = {"implementation_identifier": "fake", "data": bytes([self._senders.index(sender)]) * 16}
        take(message, {"publisher_gid": gid, "source_timestamp": now, "received_timestamp": now})

    def get_publishers_info_by_topic(self, topic: str) -> list[Any]:
        return [
            SimpleNamespace(
                node_namespace=sender.rpartition("/")[0] or "/",
                node_name=sender.rpartition("/")[2],
                endpoint_gid=[index] * 24,
            )
            for index, sender in enumerate(self._senders)
        ]

    def get_subscriptions_info_by_topic(self, topic: str) -> list[Any]:
        """A driver behind a gate; of other topics nobody asks."""
        driver = SimpleNamespace(node_namespace="/tb", node_name="driver")
        return [driver] if topic.endswith("/gate/cmd_vel") else []

    def declare_parameter(self, name: str, value: Any, descriptor: Any) -> None:
        self._parameters[name] = value
        say({"topic": "parameter", "name": name, "value": value})

    def add_on_set_parameters_callback(self, check: Any) -> None:
        self._check = check

    def set_parameters_atomically(self, parameters: list[Any]) -> None:
        assert self._check(parameters).successful
        for one in parameters:
            self.declare_parameter(one.name, one.value, None)

    def has_parameter(self, name: str) -> bool:
        return name in self._parameters

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(value=self._parameters[name])

    def get_logger(self) -> Any:
        def log(text: str) -> None:
            say({"topic": "log", "text": text})

        return SimpleNamespace(debug=log, info=log, warning=log, error=log, fatal=log)


class Publisher:
    def __init__(self, topic: str) -> None:
        self.topic = topic

    def publish(self, message: Message) -> None:
        say({"topic": self.topic, **vars(message)})

    def get_subscription_count(self) -> int:
        return listeners()


class Executor:
    """Delivers in one thread, as the real one that is single-threaded."""

    def __init__(self) -> None:
        self._ended = threading.Event()

    def add_node(self, node: Node) -> None:
        self._node = node

    def spin(self) -> None:
        while not self._ended.is_set():
            try:
                what = self._node.waiting.get(timeout=0.05)
            except queue.Empty:
                continue
            self._node.deliver(*what)

    def shutdown(self, seconds: float) -> None:
        self._ended.set()
