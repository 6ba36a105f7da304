"""Who sent a command: the GID of its publisher, and the node that this publisher belongs to."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from typing import Any, Callable

from rclpy import subscription

GID_BYTES = 16  # that are significant; Humble pads to 24
UNKNOWN = "a node that the graph does not name"
_ANNOUNCED_WITHIN = 0.3  # s after its first message, and before a robot's dead-man
_LOOK_EVERY = 0.01  # s
_MOST_WAITING = 8
_NAMELESS = "_NODE_NAME_UNKNOWN_"
_MOST = 64

#: Message, GID of its publisher, when it was sent and when it arrived: ns, each by the clock of its host.
Take = Callable[[Any, bytes, int, int], None]


class Senders:
    """The names of the nodes that publish ``topic``, by the GIDs of their publishers."""

    def __init__(self, node: Any, topic: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._node = node
        self._topic = node.resolve_topic_name(topic)
        self._clock = clock
        self._names: OrderedDict[bytes, str] = OrderedDict()
        self._waiting: set[bytes] = set()

    def when_named(self, gid: bytes, call: Callable[[str], None]) -> None:
        """Calls with the full name of the node: at once if it is known, else from a thread of its own.

        The first message of a node may come before the graph has announced it. Further ones are left out
        while the first waits.
        """
        name = self._name_of(gid)
        if name:
            call(name)
        elif gid not in self._waiting and len(self._waiting) < _MOST_WAITING:
            self._waiting.add(gid)
            threading.Thread(target=self._wait, args=(gid, call), daemon=True).start()

    def _wait(self, gid: bytes, call: Callable[[str], None]) -> None:
        until = self._clock() + _ANNOUNCED_WITHIN
        name = ""
        while not name and self._clock() < until:
            time.sleep(_LOOK_EVERY)
            name = self._name_of(gid)
        self._waiting.discard(gid)
        call(name or UNKNOWN)

    def _name_of(self, gid: bytes) -> str:
        """Returns the full name of the node; empty while the graph has not announced it."""
        if gid not in self._names:
            for one in self._node.get_publishers_info_by_topic(self._topic):
                if one.node_name != _NAMELESS:
                    name = full_name(one.node_namespace, one.node_name)
                    self._names[bytes(one.endpoint_gid)[:GID_BYTES]] = name
            while len(self._names) > _MOST:
                self._names.popitem(last=False)
        return self._names.get(gid, "")


def full_name(namespace: str, name: str) -> str:
    """Returns the full name of a node."""
    return f"{namespace.rstrip('/')}/{name}"


def subscribe_with_sender(
    node: Any, message: Any, topic: str, take: Take, profile: Any, *, raw: bool = False
) -> Callable[[], None]:
    """Passes each message on ``topic`` to ``take``, with the GID of its publisher. Returns what ends it.

    ``raw``: as serialised bytes.
    """
    info = getattr(subscription, "MessageInfo", None)  # since Kilted, with the GID
    if "publisher_gid" not in getattr(info, "__annotations__", {}):
        from swarm_onboard.ros2.rcl_take import RclSubscription  # noqa: PLC0415  needs what Kilted may lose

        taking = RclSubscription(node, message, topic, take, profile, raw=raw)
        node.add_waitable(taking)
        return taking.end

    def received(one: Any, info: Any) -> None:
        gid = bytes(info["publisher_gid"]["data"])[:GID_BYTES]
        take(one, gid, info["source_timestamp"], info["received_timestamp"])

    made = node.create_subscription(message, topic, received, profile, raw=raw)
    return lambda: node.destroy_subscription(made)
