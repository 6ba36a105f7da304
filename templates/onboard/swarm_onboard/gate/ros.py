"""The gate as a node of ROS 1: subscribes to commands, publishes what it lets through.

Nothing outside this file knows ROS.
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
from typing import Any, Callable, Iterator

import rospy
from geometry_msgs.msg import Twist, TwistStamped

from swarm_onboard.command.limits import Velocity
from swarm_onboard.command.report import Level, Report
from swarm_onboard.command.ros import Diagnostics, leave, master
from swarm_onboard.command.ros_transforms import TFMessage, start_is_lost, start_transform
from swarm_onboard.gate.config import OUTPUT, Config
from swarm_onboard.gate.odometry import OdometryWatch, Reading
from swarm_onboard.gate.power import PowerWatch

_ODOMETRY_POLL = 0.5  # s between two looks whether odometry is still wanted
_LAST_WORD = 0.1  # s for the last message to leave before its connections are closed


def join(config: Config, *, greet: Callable[[], None], end: Callable[[], None]) -> RosSink:
    """Becomes a node that publishes. Returns when the master knows it, however long that takes.

    ``greet`` is called for every new subscriber. ``end`` is called when ROS shuts the node down; it returns
    when the last velocity is sent.
    """
    rospy.init_node("gate", disable_signals=True)
    rospy.on_shutdown(end)
    return RosSink(config, greet)


class _Newcomers(rospy.SubscribeListener):
    def __init__(self, greet: Callable[[], None]) -> None:
        super().__init__()
        self._greet = greet

    def peer_subscribe(self, _topic: str, _publish: Any, _publish_to_it: Any) -> None:
        self._greet()


class RosSink:
    """Publishes a gate's velocities and reports. ``left_out``: what this host cannot publish."""

    def __init__(self, config: Config, greet: Callable[[], None]) -> None:
        stamped = config.command_type == "geometry_msgs/TwistStamped"
        self._message: Callable[[Twist], Any] = _stamped if stamped else _plain
        self._publisher = rospy.Publisher(
            OUTPUT,
            TwistStamped if stamped else Twist,
            subscriber_listener=_Newcomers(greet),
            queue_size=1,  # a subscriber that hangs holds up nobody else
            tcp_nodelay=True,
        )
        self._places = _publish_start(config)
        self.left_out = tuple(_left_out(config))
        self._diagnostics = Diagnostics(f"{config.robot}: gate", f"{config.title} {config.robot}")

    def send(self, velocity: Velocity) -> None:
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z = velocity[:3]
        twist.angular.x, twist.angular.y, twist.angular.z = velocity[3:]
        self._publisher.publish(self._message(twist))

    def receivers(self) -> int:
        return int(self._publisher.get_num_connections())

    def report(self, report: Report) -> None:
        self._diagnostics.publish(report.without(self.left_out, least=Level.WARN))

    def flush(self) -> None:
        """Waits until what was sent has left this process."""
        time.sleep(_LAST_WORD)

    def leave(self) -> None:
        leave()


def _publish_start(config: Config) -> Any:
    """Publishes the transform from `map` to the driver's odometry frame, latched; returns the publisher."""
    if config.start is None or start_is_lost(config.start):
        return None
    publisher = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
    placed = start_transform(config.start, config.odom_frame, rospy.Time.now())
    publisher.publish(TFMessage([placed]))
    return publisher


def _left_out(config: Config) -> Iterator[str]:
    """Yields what this host cannot publish because a message package is missing, as text."""
    if start_is_lost(config.start):
        yield f"no transform from map to {config.odom_frame}: this host lacks tf2_msgs"


def read_odometry(watch: OdometryWatch) -> None:
    """Starts a thread that subscribes to the driver's odometry while ``watch`` wants it.

    A thread of its own, since a master that does not answer holds it up.
    """
    threading.Thread(target=_read_odometry, args=(watch,), name="odometry", daemon=True).start()


def _read_odometry(watch: OdometryWatch) -> None:
    while True:
        watch.requested.wait()
        watch.requested.clear()
        with contextlib.suppress(Exception):  # no nav_msgs here, or no master: nothing is proven
            from nav_msgs.msg import Odometry  # noqa: PLC0415 - most gates never need it

            subscriber = rospy.Subscriber(
                watch.topic, Odometry, lambda one: watch.take(_reading(one)), queue_size=1, tcp_nodelay=True
            )
            try:
                while watch.wanted():
                    time.sleep(_ODOMETRY_POLL)
            finally:
                subscriber.unregister()


def read_power(watch: PowerWatch) -> None:
    """Starts a thread that subscribes to the topics of ``watch`` for good: messages are few."""
    threading.Thread(target=_read_power, args=(watch,), name="power", daemon=True).start()


def _read_power(watch: PowerWatch) -> None:
    with contextlib.suppress(ImportError):  # no sensor_msgs here: nothing is known
        if watch.battery:
            from sensor_msgs.msg import BatteryState  # noqa: PLC0415 - most gates never need it

            rospy.Subscriber(
                watch.battery,
                BatteryState,
                lambda one: watch.take_battery(one.percentage, one.power_supply_status),
                queue_size=1,
            )
        if watch.docked:
            from std_msgs.msg import Bool  # noqa: PLC0415

            rospy.Subscriber(watch.docked, Bool, lambda one: watch.take_docked(one.data), queue_size=1)


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


def system_state() -> Any:
    """Returns who publishes and subscribes to what. Raises any error if the master does not answer."""
    with master() as server:
        answer: Any = server.getSystemState(rospy.get_name())
    return answer[2]


def _plain(twist: Twist) -> Twist:
    return twist


def _stamped(twist: Twist) -> TwistStamped:
    message = TwistStamped()
    message.header.stamp = rospy.Time.now()
    message.twist = twist
    return message
