"""The one module that knows ROS 1: orders come in as Twist, news go out as messages."""

from __future__ import annotations

import math
import threading
import time
from http.client import HTTPConnection
from typing import Any
from xmlrpc.client import ServerProxy, Transport

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Quaternion, TransformStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from std_msgs.msg import MultiArrayDimension, UInt16MultiArray

from swarm_driver.codec import Values
from swarm_driver.config import Config, Sensor
from swarm_driver.gate import Gate
from swarm_driver.kinematics import Pose
from swarm_driver.orders import Orders
from swarm_driver.report import Report
from swarm_driver.whereabouts import Whereabouts

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # a host without tf gets odometry and no transform
    TFMessage = None

_FAREWELL = 1.0  # s
_MASTER_ANSWERS = 2.0  # s
_SUCCESS, _UNKNOWN_NODE = 1, -1  # of the Master API: lookupNode found the node, or no such node
_UNKNOWN = 1e6  # variance of what a robot on wheels cannot know
_AT_REST = 1e-6  # variance of what has not gone astray yet


def join(config: Config, orders: Orders, gate: Gate) -> RosSink:
    """Become a node that takes orders. Returns when the master knows it, however long that takes."""
    rospy.init_node("driver", disable_signals=True)
    rospy.on_shutdown(orders.stop)
    sink, whereabouts = RosSink(config), Whereabouts(_node_uri)

    def take(twist: Any) -> None:
        """Runs in the thread of the sender's own connection, so its waiting holds up nobody else's orders."""
        arrived, sender = time.monotonic(), str(twist._connection_header.get("callerid", ""))
        linear, angular = twist.linear, twist.angular
        gate.give(
            sender,
            whereabouts.of(sender),
            (linear.x, linear.y, linear.z),
            (angular.x, angular.y, angular.z),
            arrived,
        )

    rospy.Subscriber("cmd_vel", Twist, take, queue_size=1, tcp_nodelay=True)
    return sink


def forgotten() -> bool:
    """Whether the master answers and knows this node not: it was restarted, which rospy never notices."""
    try:
        return not _node_uri(rospy.get_name())
    except Exception:  # noqa: BLE001  a master that is away forgets nothing, and whatever else answers there is none
        return False


def _node_uri(node: str) -> str:
    """Where ``node`` is to be reached, as the master has it; empty if it knows no such node."""
    with ServerProxy(rosgraph.get_master_uri(), transport=_Hurried()) as master:
        code, message, uri = master.lookupNode(rospy.get_name(), node)
    if code not in (_SUCCESS, _UNKNOWN_NODE):
        raise OSError(message)
    return str(uri) if code == _SUCCESS else ""


class _Hurried(Transport):
    """HTTP that does not wait for ever."""

    def make_connection(self, host: Any) -> HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _MASTER_ANSWERS
        return connection


class RosSink:
    """Publishes what a driver finds out."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._odom_frame = config.frame_prefix + "odom"
        self._base_frame = config.frame_prefix + "base_link"
        self._odom = rospy.Publisher("odom", Odometry, queue_size=1)
        self._ranges = {
            one.name: rospy.Publisher(one.name, UInt16MultiArray, queue_size=1)
            for one in config.sensors
            if one.kind == "range"
        }
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=1) if TFMessage else None

    def odometry(self, pose: Pose) -> None:
        message = Odometry()
        message.header.stamp = rospy.Time.now()
        message.header.frame_id = self._odom_frame
        message.child_frame_id = self._base_frame
        message.pose.pose.position.x = pose.x
        message.pose.pose.position.y = pose.y
        message.pose.pose.orientation = _turned_by(pose.yaw)
        message.twist.twist.linear.x = pose.linear
        message.twist.twist.angular.z = pose.angular
        errors = self._config.kinematics
        yaw_error = errors.angular_error * pose.turned
        # A wrong heading bends the whole way that follows it, so it spoils the place as well.
        place_error = errors.linear_error * pose.driven + min(1.0, yaw_error) * pose.driven
        message.pose.covariance = _covariance(place_error, place_error, yaw_error)
        message.twist.covariance = _covariance(
            errors.linear_error * pose.linear, 0.0, errors.angular_error * pose.angular
        )
        self._odom.publish(message)
        if self._tf is not None:
            self._tf.publish(TFMessage([self._transform(message)]))

    def reading(self, sensor: Sensor, values: Values) -> None:
        if sensor.kind != "range":
            return
        largest = sensor.settings["max_reading"]
        readings = [min(max(0, int(value)), largest) for value in values]
        label = ",".join(one["name"] for one in sensor.settings["elements"])
        message = UInt16MultiArray(data=readings)
        message.layout.dim = [MultiArrayDimension(label=label, size=len(readings), stride=len(readings))]
        self._ranges[sensor.name].publish(message)

    def report(self, report: Report) -> None:
        status = DiagnosticStatus(
            level=int(report.level),
            name=f"{self._config.robot}: driver",
            message=report.message,
            hardware_id=f"{self._config.title} {self._config.robot}",
            values=[KeyValue(key, value) for key, value in report.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = rospy.Time.now()
        self._diagnostics.publish(message)

    def leave(self) -> None:
        """Take leave of the master; one that is gone is not waited for."""
        farewell = threading.Thread(target=rospy.signal_shutdown, args=("the driver ends",), daemon=True)
        farewell.start()
        farewell.join(_FAREWELL)

    def _transform(self, odometry: Any) -> Any:
        place = odometry.pose.pose.position
        transform = TransformStamped(header=odometry.header, child_frame_id=self._base_frame)
        transform.transform.translation = Vector3(place.x, place.y, 0.0)
        transform.transform.rotation = odometry.pose.pose.orientation
        return transform


def _turned_by(yaw: float) -> Any:
    return Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def _covariance(x: float, y: float, yaw: float) -> list[float]:
    """The 6 x 6 matrix of a planar pose or twist, from standard deviations."""
    variances = (x * x + _AT_REST, y * y + _AT_REST, _UNKNOWN, _UNKNOWN, _UNKNOWN, yaw * yaw + _AT_REST)
    return [variances[row] if row == column else 0.0 for row in range(6) for column in range(6)]
