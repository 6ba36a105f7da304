"""A node of ROS 2: publishers, subscriptions, parameters, and the senders of commands."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import time
from array import array
from typing import Any, Callable, Mapping, Sequence

import rclpy
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from swarm_onboard.ros.node import Kind, TakeCommand, TakeSetting
from swarm_onboard.ros.velocities import VELOCITIES, twist_and_stamp
from swarm_onboard.ros2 import ros1_bytes
from swarm_onboard.ros2.late import Late
from swarm_onboard.ros2.parameters import flat
from swarm_onboard.ros2.senders import Senders, full_name, subscribe_with_sender

EXPIRES = 0.5  # s after which a network drops a command of ours: a robot's dead-man would have stopped it
_NEWCOMERS_EVERY = 0.1  # s between two looks for new subscribers
_FAREWELL = 1.0  # s
_LOOK_EVERY = 0.5  # s, whether this host has its address
_ERROR = 3  # of rosserial_msgs/Log
_DEPTHS = {Kind.SENSOR: 5, Kind.STATE: 10, Kind.COMMAND: 1, Kind.LATCHED: 1}


def quality(kind: Kind, *, publishes: bool) -> QoSProfile:
    """Returns the quality of service of a topic.

    A subscription asks for no deadline: a publisher that promises none, as most, could not connect.
    """
    profile = QoSProfile(depth=_DEPTHS[kind])
    profile.reliability = ReliabilityPolicy.BEST_EFFORT if kind is Kind.SENSOR else ReliabilityPolicy.RELIABLE
    if kind is Kind.LATCHED:
        profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    if kind is Kind.COMMAND and publishes:
        profile.lifespan = Duration(seconds=EXPIRES)
    return profile


def join(name: str, namespace: str, _end: Callable[[], None]) -> Node:
    """Becomes the node ``name``, once this host has its address. Nobody in ROS 2 ends another node."""
    _await_address(os.environ.get("SWARM_ADDRESS", ""))
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    simulated = Parameter("use_sim_time", value=os.environ.get("SWARM_USE_SIM_TIME") == "1")
    return Node(rclpy.create_node(name, namespace=namespace or "/", parameter_overrides=[simulated]))


join_for_good = join


def _await_address(address: str) -> None:
    """Waits until this host has ``address``: DDS looks once which addresses there are."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    while address:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind((address, 0))
            except OSError:
                time.sleep(_LOOK_EVERY)
            else:
                return


class _Publisher:
    def __init__(self, node: Any, publisher: Any) -> None:
        self._node, self._publisher = node, publisher

    def publish(self, message: Any) -> None:
        if self._node.context.ok():
            self._publisher.publish(message)

    def listeners(self) -> int:
        return int(self._publisher.get_subscription_count())

    def close(self) -> None:
        self._node.destroy_publisher(self._publisher)


class _BoardPublisher(_Publisher):
    def __init__(self, node: Node, publisher: Any, kind: str) -> None:
        super().__init__(node.rcl, publisher)
        self._log, self._kind = node.log, kind

    def publish(self, message: bytes) -> None:
        try:
            super().publish(ros1_bytes.decode(self._kind, message))
        except ValueError as error:  # the sketch was built with another definition than it announced
            self._log(_ERROR, f"a message of the sketch: {error}")


class _Subscription:
    def __init__(self, node: Any, subscription: Any) -> None:
        self._node, self._subscription = node, subscription

    def close(self) -> None:
        self._node.destroy_subscription(self._subscription)


class Node:
    """The one node of this process, ``rcl``, and the thread in which its messages arrive."""

    def __init__(self, node: Any) -> None:
        self.rcl = node
        self._shown: Mapping[str, Any] = {}
        node.add_on_set_parameters_callback(self._guarded)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._spinning = threading.Thread(target=self._spin, name="ros", daemon=True)
        self._spinning.start()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()

    @property
    def name(self) -> str:
        return str(self.rcl.get_fully_qualified_name())

    def now(self) -> Any:
        return self.rcl.get_clock().now().to_msg()

    def octets(self, data: bytes) -> Any:
        return array("B", data)  # of bytes, rclpy checks each one

    def publisher(
        self, topic: str, message: Any, kind: Kind, greet: Callable[[], None] | None = None
    ) -> _Publisher:
        made = self.rcl.create_publisher(message, topic, quality(kind, publishes=True))
        publisher = _Publisher(self.rcl, made)
        if greet is not None:
            self.rcl.create_timer(_NEWCOMERS_EVERY, _Newcomers(publisher.listeners, greet).look)
        return publisher

    def subscribe(self, topic: str, message: Any, take: Callable[[Any], None], kind: Kind) -> _Subscription:
        profile = quality(kind, publishes=False)
        return _Subscription(self.rcl, self.rcl.create_subscription(message, topic, take, profile))

    def subscribe_to_commands(self, topic: str, kind: str, take: TakeCommand) -> None:
        """What a network held up for longer than others is left out: it was meant for another moment."""
        senders, late = Senders(self.rcl, topic), Late(EXPIRES)

        def received(message: Any, gid: bytes, sent: int, arrived: int) -> None:
            """Times in ns, each by the clock of its host."""
            if late.is_late(gid, sent * 1e-9, arrived * 1e-9):
                return
            twist, stamp = twist_and_stamp(message)
            linear = (twist.linear.x, twist.linear.y, twist.linear.z)
            angular = (twist.angular.x, twist.angular.y, twist.angular.z)
            moment, age = time.monotonic(), self._age(stamp)
            # The graph does not say where a node runs: no host.
            senders.when_named(gid, lambda sender: take(sender, "", linear, angular, moment, age=age))

        profile = quality(Kind.COMMAND, publishes=False)
        subscribe_with_sender(self.rcl, VELOCITIES[kind], topic, received, profile)

    def _age(self, stamp: Any) -> float:
        """Returns how long ago it was by the clock of ROS, s; 0 without one, or if it is not set."""
        moment = stamp.sec * 10**9 + stamp.nanosec if stamp is not None else 0
        return float(self.rcl.get_clock().now().nanoseconds - moment) * 1e-9 if moment else 0.0

    def subscribe_to_settings(self, topic: str, message: Any, take: TakeSetting) -> None:
        senders = Senders(self.rcl, topic)

        def received(setting: Any, gid: bytes, _sent: int, _arrived: int) -> None:
            senders.when_named(gid, lambda sender: take(sender, "", setting))

        subscribe_with_sender(self.rcl, message, topic, received, quality(Kind.STATE, publishes=False))

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        self._shown = dict(flat(values))
        typed = ParameterDescriptor(dynamic_typing=True)  # 1 is of another type than 0.5
        for name, value in self._shown.items():
            if self.rcl.has_parameter(name):
                self.rcl.set_parameters_atomically([Parameter(name, value=value)])
            else:
                self.rcl.declare_parameter(name, value, typed)

    def _guarded(self, parameters: Sequence[Any]) -> SetParametersResult:
        """Refuses another value of what this node shows, as it does not read it."""
        if all(one.value == self._shown.get(one.name, one.value) for one in parameters):
            return SetParametersResult(successful=True)
        return SetParametersResult(successful=False, reason="its parameter file has the value")

    def describe(self, urdf: str) -> None:
        self.publisher("robot_description", String, Kind.LATCHED).publish(String(data=urdf))

    def parameter(self, name: str) -> Any:
        short = name.lstrip("~/")
        if not self.rcl.has_parameter(short):
            raise KeyError(name)
        return self.rcl.get_parameter(short).value

    def log(self, level: int, text: str) -> None:
        logger = self.rcl.get_logger()
        logs = (logger.debug, logger.info, logger.warning, logger.error, logger.fatal)
        logs[min(level, len(logs) - 1)](text)

    def publishers_and_subscribers(self, topics: Sequence[str]) -> dict[str, tuple[list[str], list[str]]]:
        return {
            topic: (
                _names(self.rcl.get_publishers_info_by_topic(topic)),
                _names(self.rcl.get_subscriptions_info_by_topic(topic)),
            )
            for topic in topics
        }

    def has_ended(self, _node: str) -> bool:
        """A graph of ROS 2 forgets a node that has ended."""
        return False

    def is_forgotten(self) -> bool:
        return False

    def board_publisher(self, topic: str, kind: str) -> _BoardPublisher:
        profile = quality(Kind.STATE, publishes=True)
        made = self.rcl.create_publisher(ros1_bytes.message_class(kind), topic, profile)
        return _BoardPublisher(self, made, kind)

    def board_subscription(self, topic: str, kind: str, take: Callable[[bytes], None]) -> _Subscription:
        def received(message: Any) -> None:
            take(ros1_bytes.encode(message))

        return self.subscribe(topic, ros1_bytes.message_class(kind), received, Kind.STATE)

    def leave(self) -> None:
        farewell = threading.Thread(target=self._leave, daemon=True)
        farewell.start()
        farewell.join(_FAREWELL)

    def _leave(self) -> None:
        self._executor.shutdown(_FAREWELL)
        self._spinning.join()
        self.rcl.destroy_node()
        rclpy.try_shutdown()


class _Newcomers:
    """Humble has no event for a new subscriber: this looks whether there are more."""

    def __init__(self, listeners: Callable[[], int], greet: Callable[[], None]) -> None:
        self._listeners, self._greet = listeners, greet
        self._known = 0

    def look(self) -> None:
        now = self._listeners()
        if now > self._known:
            self._greet()
        self._known = now


def _names(endpoints: Sequence[Any]) -> list[str]:
    return [full_name(one.node_namespace, one.node_name) for one in endpoints]
