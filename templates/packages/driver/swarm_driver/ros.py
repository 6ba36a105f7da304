"""The driver as a node of ROS 1: subscribes to commands, publishes data.

Nothing outside `ros*.py` knows ROS.
"""

from __future__ import annotations

import threading
import time
from http.client import HTTPConnection
from typing import Any, Iterator, Mapping
from xmlrpc.client import ServerProxy, Transport

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Twist
from std_msgs.msg import UInt8, UInt8MultiArray

from swarm_driver import ros_frames, ros_sensors
from swarm_driver.actuators import ActuatorSettings
from swarm_driver.codec import Values
from swarm_driver.command_gate import CommandGate
from swarm_driver.command_mailbox import CommandMailbox
from swarm_driver.config import Actuator, Config, Sensor
from swarm_driver.kinematics import Pose
from swarm_driver.node_hosts import NodeHosts
from swarm_driver.report import Report
from swarm_driver.ros_frames import Frames
from swarm_driver.ros_motion import MotionTopics

_FAREWELL = 1.0  # s
_MASTER_ANSWERS = 2.0  # s
_SUCCESS, _UNKNOWN_NODE = 1, -1  # of the Master API: lookupNode found the node, or no such node


def join(config: Config, commands: CommandMailbox, gate: CommandGate, outputs: ActuatorSettings) -> RosSink:
    """Becomes a node that subscribes to commands.

    Returns when the master knows it, however long that takes.
    """
    rospy.init_node("driver", disable_signals=True)
    rospy.on_shutdown(commands.stop)
    sink, node_hosts = RosSink(config), NodeHosts(_node_uri)

    def take(twist: Any) -> None:
        """Runs in the thread of the sender's connection, so its waiting delays no other sender's commands."""
        arrived, sender = time.monotonic(), str(twist._connection_header.get("callerid", ""))
        linear, angular = twist.linear, twist.angular
        gate.give(
            sender,
            node_hosts.of(sender),
            (linear.x, linear.y, linear.z),
            (angular.x, angular.y, angular.z),
            arrived,
        )

    rospy.Subscriber("cmd_vel", Twist, take, queue_size=1, tcp_nodelay=True)
    for actuator in config.actuators:
        _subscribe(actuator, outputs)
    return sink


def _subscribe(actuator: Actuator, outputs: ActuatorSettings) -> None:
    """Subscribes to a number for one channel, to a list with one number each for several."""
    if len(actuator.channels) == 1:
        rospy.Subscriber(
            actuator.name, UInt8, lambda message: outputs.put(actuator, [message.data]), queue_size=1
        )
    else:
        rospy.Subscriber(
            actuator.name,
            UInt8MultiArray,
            lambda message: outputs.put(actuator, list(message.data)),
            queue_size=1,
        )


def forgotten() -> bool:
    """Returns True if the master answers but does not know this node: it was restarted."""
    try:
        return not _node_uri(rospy.get_name())
    except Exception:  # noqa: BLE001  a master that is away forgets nothing, and whatever else answers there is none
        return False


def _node_uri(node: str) -> str:
    """Returns the URI of ``node`` as the master lists it; empty if it knows no such node."""
    with ServerProxy(rosgraph.get_master_uri(), transport=TimeoutTransport()) as master:
        answer: Any = master.lookupNode(rospy.get_name(), node)
    code, message, uri = answer
    if code not in (_SUCCESS, _UNKNOWN_NODE):
        raise OSError(message)
    return str(uri) if code == _SUCCESS else ""


class TimeoutTransport(Transport):
    """An HTTP transport with a timeout."""

    def make_connection(self, host: Any) -> HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _MASTER_ANSWERS
        return connection


class RosSink:
    """Publishes a driver's data. ``left_out`` are the topics for which this host has no message package."""

    def __init__(self, config: Config) -> None:
        self._config = config
        frames = Frames(config)
        self._motion = MotionTopics(config, frames)
        self._sensors = ros_sensors.topics_of(config, frames)
        self._places = ros_frames.publish_places(config, frames)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
        self.left_out = tuple(_left_out(config, self._sensors))

    def odometry(self, pose: Pose) -> None:
        self._motion.publish(pose)

    def reading(self, sensor: Sensor, values: Values) -> None:
        topics = self._sensors.get(sensor.name)
        if topics is not None:
            topics.publish(values)

    def report(self, report: Report) -> None:
        figures = dict(report.values, **({"left out": "; ".join(self.left_out)} if self.left_out else {}))
        status = DiagnosticStatus(
            level=int(report.level),
            name=f"{self._config.robot}: driver",
            message="; ".join([report.message, *self.left_out]),
            hardware_id=f"{self._config.title} {self._config.robot}",
            values=[KeyValue(key, value) for key, value in figures.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = rospy.Time.now()
        self._diagnostics.publish(message)

    def leave(self) -> None:
        """Take leave of the master; one that is gone is not waited for."""
        farewell = threading.Thread(target=rospy.signal_shutdown, args=("the driver ends",), daemon=True)
        farewell.start()
        farewell.join(_FAREWELL)


def _left_out(config: Config, sensors: Mapping[str, Any]) -> Iterator[str]:
    """Returns the topics that this host cannot publish because a message package is missing, as text."""
    if ros_frames.TFMessage is None:
        yield "no transforms: this host lacks tf2_msgs"
    if ros_sensors.sensor_msgs is not None:
        return
    missing = [one.name for one in config.sensors if one.rate > 0 and one.kind != "wheels"]
    missing = [name for name in missing if name not in sensors]
    missing += ["joint_states"] if config.kinematics.wheel_radius is not None else []
    missing += [f"{one.name}/*" for one in config.sensors if one.rate > 0 and one.kind == "range"]
    if missing:
        yield f"no {', '.join(missing)}: this host lacks sensor_msgs"
