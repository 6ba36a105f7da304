"""A node of ROS 1: publishers, subscribers, parameters, and the senders of commands with their hosts."""

from __future__ import annotations

import contextlib
import threading
import time
from typing import TYPE_CHECKING, Any, Callable, Mapping, Sequence

import rospy

from swarm_onboard.ros.latched import Latched
from swarm_onboard.ros.node import Kind, TakeCommand, TakeSetting
from swarm_onboard.ros.velocities import VELOCITIES, twist_and_stamp
from swarm_onboard.ros1 import master
from swarm_onboard.ros1.board_types import raw_class

if TYPE_CHECKING:
    from swarm_onboard.ros1.registration import Registration

_FAREWELL = 1.0  # s
_BOARD_QUEUE = 10


def join(name: str, _namespace: str, end: Callable[[], None]) -> Node:
    """Becomes the node ``name``. Returns when the master knows it, however long that takes."""
    master.await_sim_time()
    rospy.init_node(name, disable_signals=True)
    rospy.on_shutdown(end)
    return Node()


def join_for_good(name: str, namespace: str, end: Callable[[], None]) -> Node:
    """Becomes the node ``name``, which nobody's request ends. Else as ``join``."""
    # They change rospy, which a teleop leaves as it is.
    from swarm_onboard.ros1 import connections, registration  # noqa: PLC0415

    connections.bound()
    registration.ignore_shutdown_requests()
    node = join(name, namespace, end)
    node.registration = registration.Registration()
    return node


def _subscribe_with_sender(topic: str, message: Any, take: Callable[[str, str | None, Any], None]) -> None:
    """Passes on each message with its sender: the node that it says it is, and the host, in lower case.

    The host is the one to which this node has connected, as the publisher's node advertises it. None once
    that connection has ended, and for an empty host, which means this computer and names none.
    """
    subscriber = rospy.Subscriber(topic, message, queue_size=1, tcp_nodelay=True).impl

    def received(one: Any) -> None:
        header = one._connection_header
        found = (str(own.remote_endpoint[0]) for own in subscriber.connections if own.header is header)
        take(str(header.get("callerid", "")), next(found, "").lower() or None, one)

    subscriber.add_callback(received, None)


def _age(stamp: Any) -> float:
    """Returns how long ago ``stamp`` was by the clock of ROS, s; 0 without one, or if it is not set."""
    moment = float(stamp.to_sec()) if stamp is not None else 0.0
    return rospy.get_time() - moment if moment else 0.0


class _Publisher:
    def __init__(self, publisher: Any) -> None:
        self._publisher = publisher

    def publish(self, message: Any) -> None:
        with contextlib.suppress(rospy.ROSException):  # closed: ROS is shutting down
            self._publisher.publish(message)

    def listeners(self) -> int:
        return int(self._publisher.get_num_connections())

    def close(self) -> None:
        self._publisher.unregister()


class _BoardPublisher(_Publisher):
    def publish(self, message: bytes) -> None:
        raw = self._publisher.data_class()
        raw._buff = message
        super().publish(raw)


class _Subscription:
    def __init__(self, subscriber: Any) -> None:
        self._subscriber = subscriber

    def close(self) -> None:
        self._subscriber.unregister()


class _Newcomers(rospy.SubscribeListener):
    def __init__(self, greet: Callable[[], None]) -> None:
        super().__init__()
        self._greet = greet

    def peer_subscribe(self, _topic: str, _publish: Any, _publish_to_it: Any) -> None:
        self._greet()


class Node:
    """The one node of this process. ``registration``: of one that joined for good."""

    registration: Registration | None = None

    @property
    def name(self) -> str:
        return str(rospy.get_name())

    def now(self) -> Any:
        return rospy.Time.now()

    def octets(self, data: bytes) -> Any:
        return data

    def publisher(
        self, topic: str, message: Any, kind: Kind, greet: Callable[[], None] | None = None
    ) -> _Publisher:
        return _Publisher(
            rospy.Publisher(
                topic,
                message,
                subscriber_listener=_Newcomers(greet) if greet is not None else None,
                latch=kind is Kind.LATCHED,
                tcp_nodelay=kind is Kind.COMMAND,
                queue_size=1,  # a subscriber that hangs holds up nobody else
            )
        )

    def subscribe(self, topic: str, message: Any, take: Callable[[Any], None], kind: Kind) -> _Subscription:
        return _Subscription(rospy.Subscriber(topic, message, take, queue_size=1, tcp_nodelay=True))

    def subscribe_to_commands(self, topic: str, kind: str, take: TakeCommand) -> None:
        """What a publisher latched before this node connected is left out: it was for another moment."""
        latched = Latched(self._publishers(topic))

        def received(sender: str, host: str | None, message: Any) -> None:
            """Runs in the thread of the sender's connection."""
            arrived, connection = time.monotonic(), message._connection_header
            if connection.get("latching") == "1" and latched.repeats(sender, connection):
                return
            twist, stamp = twist_and_stamp(message)
            linear = (twist.linear.x, twist.linear.y, twist.linear.z)
            angular = (twist.angular.x, twist.angular.y, twist.angular.z)
            take(sender, host, linear, angular, arrived, age=_age(stamp))

        _subscribe_with_sender(topic, VELOCITIES[kind], received)

    def subscribe_to_settings(self, topic: str, message: Any, take: TakeSetting) -> None:
        _subscribe_with_sender(topic, message, take)

    def _publishers(self, topic: str) -> list[str]:
        """The nodes that publish on ``topic`` now; none if the master does not answer."""
        try:
            return master.publishers_and_subscribers()[0].get(rospy.resolve_name(topic), [])
        except Exception:  # noqa: BLE001  then a command that was latched before counts as new
            return []

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        rospy.set_param(rospy.get_name(), dict(values))

    def describe(self, urdf: str) -> None:
        rospy.set_param("robot_description", urdf)

    def parameter(self, name: str) -> Any:
        return rospy.get_param(name)

    def log(self, level: int, text: str) -> None:
        logs = (rospy.logdebug, rospy.loginfo, rospy.logwarn, rospy.logerr, rospy.logfatal)
        logs[min(level, len(logs) - 1)]("%s", text)

    def publishers_and_subscribers(self, topics: Sequence[str]) -> dict[str, tuple[list[str], list[str]]]:
        publishers, subscribers = master.publishers_and_subscribers()
        return {topic: (publishers.get(topic, []), subscribers.get(topic, [])) for topic in topics}

    def has_ended(self, node: str) -> bool:
        return master.has_ended(node)

    def is_forgotten(self) -> bool:
        return not self.registration.is_kept() if self.registration is not None else master.is_forgotten()

    def board_publisher(self, topic: str, kind: str) -> _BoardPublisher:
        return _BoardPublisher(rospy.Publisher(topic, raw_class(kind), queue_size=_BOARD_QUEUE))

    def board_subscription(self, topic: str, kind: str, take: Callable[[bytes], None]) -> _Subscription:
        def received(message: Any) -> None:
            take(message._buff)

        return _Subscription(rospy.Subscriber(topic, raw_class(kind), received, queue_size=_BOARD_QUEUE))

    def leave(self) -> None:
        farewell = threading.Thread(target=rospy.signal_shutdown, args=("the node ends",), daemon=True)
        farewell.start()
        farewell.join(_FAREWELL)
