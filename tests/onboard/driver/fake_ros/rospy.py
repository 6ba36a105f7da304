"""As much of rospy as the nodes of a driver and a gate touch, without a master (see fake_graph).

With FAKE_MASTER=away in the environment no node ever joins.
"""

from __future__ import annotations

import os
import queue
import sys
import threading
import time
import types
from typing import Any, ClassVar

from fake_graph import Message, listen, listeners, say


def init_node(name: str, disable_signals: bool) -> None:
    while os.environ.get("FAKE_MASTER") == "away":
        time.sleep(0.1)


def get_name() -> str:
    return "/driver"


def get_node_uri() -> str:
    return "http://here:1/"


def get_time() -> float:
    return time.time()


def set_param(name: str, value: Any) -> None:
    say({"topic": "parameter", "name": name, "value": value})


_HOOKS: list[Any] = []


def on_shutdown(hook: Any) -> None:
    """Runs when the test writes the line ``failure``, as when the server of the slave API fails."""
    _HOOKS.append(hook)


def signal_shutdown(reason: str) -> None:
    say({"topic": "shutdown", "reason": reason})


class ROSHandler:
    """The slave API. The line ``shutdown`` calls it as a master does when another node has the name."""

    def shutdown(self, _caller: str, _reason: str) -> Any:
        _fail()


class TopicManager:
    """Lists what the node publishes and subscribes to, and connects it to publishers."""

    def get_publications(self) -> list[tuple[str, str]]:
        return [("/odom", "nav_msgs/Odometry")]

    def get_subscriptions(self) -> list[tuple[str, str]]:
        return [("/cmd_vel", "geometry_msgs/Twist")]

    def get_services(self) -> list[tuple[str, str]]:
        return [("/driver/get_loggers", "rosrpc://127.0.0.1:4712")]

    @property
    def listeners(self) -> list[TopicManager]:
        return [self]

    def publisher_update(self, topic: str, publishers: list[str]) -> None:
        say({"topic": "connects", "name": topic, "to": publishers})


def _module(name: str, **contents: Any) -> None:
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__dict__.update(contents)


_module("rospy.impl")
_module("rospy.impl.tcpros_base", TCPServer=object)
_module("rosgraph.network", get_bind_address=lambda _address=None: "0.0.0.0")
_module("rosgraph.xmlrpc", ThreadingXMLRPCServer=object, SilenceableXMLRPCRequestHandler=object)
_module("rospy.impl.masterslave", ROSHandler=ROSHandler)
_module(
    "rospy.impl.registration",
    **dict.fromkeys(("get_registration_listeners", "get_service_manager", "get_topic_manager"), TopicManager),
)


class ROSException(Exception):  # noqa: N818  its name in rospy
    """Such as: publish() to a closed topic."""


class Time:
    now = staticmethod(time.time)


class AnyMsg:
    """A message whose bytes nobody looks into."""

    _buff: bytes


class SubscribeListener:
    """Is never called: everybody listens from the beginning."""


class Publisher:
    def __init__(self, topic: str, data_class: Any, **_: Any) -> None:
        self.data_class = data_class
        self._topic = topic

    def publish(self, message: Message | AnyMsg) -> None:
        if isinstance(message, AnyMsg):
            kind = type(message)
            say({"topic": self._topic, "is": [kind._type, kind._md5sum], "bytes": message._buff.hex()})
            return
        say({"topic": self._topic, **vars(message)})

    def unregister(self) -> None:
        say({"topic": "no more", "name": self._topic})

    def get_num_connections(self) -> int:
        return listeners()


class _Connection:
    """A sender's, to its host: ``/node@host``, or the host of the tester."""

    def __init__(self, sender: str) -> None:
        node, placed, host = sender.partition("@")
        self.header = {"callerid": node}
        self.remote_endpoint = (host if placed else "192.168.77.10", 40001)
        self.arrived: queue.Queue[Any] = queue.Queue()


class Subscriber:
    """Each sender has a thread of its own, as rospy has it."""

    subscribers: ClassVar[dict[str, Subscriber]] = {}

    def __init__(self, topic: str, kind: Any, take: Any = None, **_: Any) -> None:
        self._topic, self._kind, self._take = topic, kind, take
        self._connections: dict[str, _Connection] = {}
        self.impl = self
        self.subscribers[topic] = self
        if len(self.subscribers) == 1:
            listen({"failure": _fail, "shutdown": _shut_down}, _deliver)
        say({"topic": "subscribes", "name": topic})

    def unregister(self) -> None:
        del self.subscribers[self._topic]
        say({"topic": "no more", "name": self._topic})

    def deliver(self, sender: str, message: Message | AnyMsg) -> None:
        if sender not in self._connections:
            self._connections[sender] = connection = _Connection(sender)
            threading.Thread(target=self._receive, args=(connection,), daemon=True).start()
        self._connections[sender].arrived.put(message)

    def add_callback(self, take: Any, _args: Any) -> None:
        self._take = take

    @property
    def connections(self) -> list[_Connection]:
        return list(self._connections.values())

    def _receive(self, connection: _Connection) -> None:
        while True:
            message = connection.arrived.get()
            message._connection_header = connection.header
            if self._take is not None and isinstance(message, (self._kind, AnyMsg)):
                self._take(message)


def _shut_down() -> None:
    ROSHandler().shutdown("master", f"[{get_name()}] Reason: new node registered with same name")


def _fail() -> None:
    for hook in _HOOKS:
        hook()


def _deliver(topic: str, sender: str, message: Message | bytes) -> None:
    if isinstance(message, bytes):
        anything = AnyMsg()
        anything._buff = message
        Subscriber.subscribers[topic].deliver(sender, anything)
        return
    Subscriber.subscribers[topic].deliver(sender, message)
