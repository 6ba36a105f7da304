"""The gate as a node of ROS: publishes what it lets through, reads odometry and batteries."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from typing import Any, Callable, Iterator

from geometry_msgs.msg import Twist, TwistStamped

from swarm_onboard.command.diagnostics import Diagnostics
from swarm_onboard.command.limits import Velocity
from swarm_onboard.command.report import Level, Report
from swarm_onboard.command.transforms import TFMessage, start_is_lost, start_transform
from swarm_onboard.gate.config import OUTPUT, Config
from swarm_onboard.gate.robot_state import OdometryWatch, PowerWatch, Reading
from swarm_onboard.ros.node import Kind, Node
from swarm_onboard.ros.velocities import VELOCITIES

_ODOMETRY_POLL = 0.5  # s between two looks whether odometry is still wanted
_LAST_WORD = 0.1  # s for the last message to leave before its connections are closed


class GateTopics:
    """Publishes a gate's velocities and reports. ``left_out``: what this host cannot publish.

    ``greet`` is called for every new subscriber.
    """

    def __init__(self, node: Node, config: Config, greet: Callable[[], None]) -> None:
        self._node = node
        message = VELOCITIES[config.output_type]
        self._stamped = message is TwistStamped
        self._publisher = node.publisher(OUTPUT, message, Kind.COMMAND, greet)
        self._places = _publish_start(node, config)
        self.left_out = tuple(_left_out(config))
        self._diagnostics = Diagnostics(node, f"{config.robot}: gate", f"{config.title} {config.robot}")

    def send(self, velocity: Velocity) -> None:
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z = velocity[:3]
        twist.angular.x, twist.angular.y, twist.angular.z = velocity[3:]
        self._publisher.publish(self._with_stamp(twist) if self._stamped else twist)

    def receivers(self) -> int:
        return self._publisher.listeners()

    def report(self, report: Report) -> None:
        self._diagnostics.publish(report.without(self.left_out, least=Level.WARN))

    def flush(self) -> None:
        """Waits until what was sent has left this process."""
        time.sleep(_LAST_WORD)

    def leave(self) -> None:
        self._node.leave()

    def _with_stamp(self, twist: Twist) -> TwistStamped:
        message = TwistStamped()
        message.header.stamp = self._node.now()
        message.twist = twist
        return message


def _publish_start(node: Node, config: Config) -> Any:
    """Publishes the transform from `map` to the driver's odometry frame, latched; returns the publisher."""
    if config.start is None or start_is_lost(config.start):
        return None
    publisher = node.publisher("/tf_static", TFMessage, Kind.LATCHED)
    placed = start_transform(config.start, config.odom_frame, node.now())
    publisher.publish(TFMessage(transforms=[placed]))
    return publisher


def _left_out(config: Config) -> Iterator[str]:
    """Yields what this host cannot publish because a message package is missing, as text."""
    if start_is_lost(config.start):
        yield f"no transform from map to {config.odom_frame}: this host lacks tf2_msgs"


def read_odometry(node: Node, watch: OdometryWatch) -> None:
    """Starts a thread that subscribes to the driver's odometry while ``watch`` wants it.

    A thread of its own, since a master that does not answer holds it up.
    """
    threading.Thread(target=_read_odometry, args=(node, watch), name="odometry", daemon=True).start()


def _read_odometry(node: Node, watch: OdometryWatch) -> None:
    while True:
        watch.requested.wait()
        watch.requested.clear()
        with contextlib.suppress(Exception):  # no nav_msgs here, or no master: nothing is proven
            from nav_msgs.msg import Odometry  # noqa: PLC0415 - most gates never need it

            subscription = node.subscribe(
                watch.topic, Odometry, lambda one: watch.take(_reading(one)), Kind.SENSOR
            )
            try:
                while watch.wanted():
                    time.sleep(_ODOMETRY_POLL)
            finally:
                subscription.close()


def read_power(node: Node, watch: PowerWatch) -> None:
    """Starts a thread that subscribes to the topics of ``watch`` for good: messages are few."""
    threading.Thread(target=_read_power, args=(node, watch), name="power", daemon=True).start()


def _read_power(node: Node, watch: PowerWatch) -> None:
    with contextlib.suppress(ImportError):  # no sensor_msgs here: nothing is known
        if watch.battery:
            from sensor_msgs.msg import BatteryState  # noqa: PLC0415 - most gates never need it

            node.subscribe(
                watch.battery,
                BatteryState,
                lambda one: watch.take_battery(one.percentage, one.power_supply_status),
                Kind.SENSOR,
            )
        if watch.docked:
            from std_msgs.msg import Bool  # noqa: PLC0415

            node.subscribe(watch.docked, Bool, lambda one: watch.take_docked(one.data), Kind.SENSOR)


def _reading(message: Any) -> Reading:
    place, turned = message.pose.pose.position, message.pose.pose.orientation
    speed, rate = message.twist.twist.linear, message.twist.twist.angular
    yaw = math.atan2(
        2 * (turned.w * turned.z + turned.x * turned.y), 1 - 2 * (turned.y * turned.y + turned.z * turned.z)
    )
    return Reading(
        place.x,
        place.y,
        place.z,
        yaw,
        math.hypot(math.hypot(speed.x, speed.y), speed.z),
        rate.z,
        time.monotonic(),
    )
