"""Subscriptions of a recorder: each topic with the quality of service that all its publishers offer."""

from __future__ import annotations

import time
from typing import Any, Callable, Sequence

from rclpy import subscription

from swarm_onboard.ros2.quality import quality_of
from swarm_onboard.ros2_probe.listening import message_class

_DEPTH = 100  # messages of a topic that wait while others are written
_HAS_TIMES = hasattr(getattr(subscription, "Subscription", None), "CallbackType")  # not in Humble

#: Topic, type, serialised message, when it arrived and when it was sent, ns since 1970.
Take = Callable[[str, str, bytes, int, int], None]


class Subscriptions:
    """Passes each message of ``topics`` to ``take``. ``lacking``: types that this host does not have."""

    def __init__(self, node: Any, topics: Sequence[str], take: Take) -> None:
        self._node, self._topics, self._take = node, topics, take
        self._made: dict[str, tuple[tuple[Any, ...], Any]] = {}  # what it was made for, and the subscription
        self.lacking: set[str] = set()

    def follow(self) -> None:
        """Subscribes to topics that are published now, and anew to those with other publishers."""
        for topic in self._topics:
            publishers = self._node.get_publishers_info_by_topic(topic)
            if not publishers:
                continue
            kind = publishers[0].topic_type
            quality = quality_of(publishers, _DEPTH)
            wanted = kind, quality.reliability, quality.durability
            before, made = self._made.get(topic, ((), None))
            if wanted == before or kind in self.lacking:
                continue
            try:
                message = message_class(kind)
            except Exception:  # noqa: BLE001  whatever is wrong with a package of the host
                self.lacking.add(kind)
                continue
            if made is not None:
                self._node.destroy_subscription(made)
            made = self._node.create_subscription(
                message, topic, self._taking(topic, kind), quality, raw=True
            )
            self._made[topic] = wanted, made

    def _taking(self, topic: str, kind: str) -> Callable[..., None]:
        def take(message: bytes) -> None:
            now = time.time_ns()
            self._take(topic, kind, message, now, now)

        def take_with_times(message: bytes, info: Any) -> None:
            arrived = info["received_timestamp"] or time.time_ns()
            self._take(topic, kind, message, arrived, info["source_timestamp"] or arrived)

        return take_with_times if _HAS_TIMES else take
