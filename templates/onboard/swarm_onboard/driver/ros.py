"""The driver as a node of ROS 1: subscribes to commands, publishes data.

Nothing outside `ros*.py` knows ROS.
"""

from __future__ import annotations

from typing import Any, Iterator, Mapping

import rospy
from std_msgs.msg import UInt8, UInt8MultiArray

from swarm_onboard.command.command_gate import CommandGate
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.report import Level, Report
from swarm_onboard.command.ros import Diagnostics, leave, subscribe
from swarm_onboard.command.ros_transforms import TFMessage, start_is_lost
from swarm_onboard.driver import ros_frames, ros_sensors
from swarm_onboard.driver.actuators import ActuatorSettings
from swarm_onboard.driver.codec import Values
from swarm_onboard.driver.config import Actuator, Config, Sensor
from swarm_onboard.driver.kinematics import Pose
from swarm_onboard.driver.ros_frames import Frames
from swarm_onboard.driver.ros_motion import MotionTopics


def join(config: Config, commands: CommandMailbox, gate: CommandGate, outputs: ActuatorSettings) -> RosSink:
    """Becomes a node that subscribes to commands.

    Returns when the master knows it, however long that takes.
    """
    rospy.init_node("driver", disable_signals=True)
    rospy.on_shutdown(commands.stop)
    sink = RosSink(config)
    subscribe("cmd_vel", gate)
    for actuator in config.actuators:
        _subscribe(actuator, outputs)
    sink.left_out += tuple(_set_params(config))
    return sink


def _set_params(config: Config) -> Iterator[str]:
    """Shows what the driver works with; what it works with stays as its parameter file has it.

    Yields what could not be shown.
    """
    try:
        rospy.set_param(rospy.get_name(), dict(config.shown))
        if config.urdf is not None:
            rospy.set_param("robot_description", config.urdf.read_text("utf-8"))
    except Exception as error:  # noqa: BLE001  the robot drives without them
        yield f"no parameters: {error}"


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


class RosSink:
    """Publishes a driver's data. ``left_out`` are the topics for which this host has no message package."""

    def __init__(self, config: Config) -> None:
        self._config = config
        frames = Frames(config)
        self._motion = MotionTopics(config, frames)
        self._sensors = ros_sensors.topics_of(config, frames)
        self._places = ros_frames.publish_places(config, frames)
        self._diagnostics = Diagnostics(f"{config.robot}: driver", f"{config.title} {config.robot}")
        self.left_out = tuple(_left_out(config, self._sensors))

    def odometry(self, pose: Pose) -> None:
        self._motion.publish(pose)

    def reading(self, sensor: Sensor, values: Values) -> None:
        topics = self._sensors.get(sensor.name)
        if topics is not None:
            topics.publish(values)

    def report(self, report: Report) -> None:
        least = Level.WARN if start_is_lost(self._config.start) else Level.OK
        self._diagnostics.publish(report.without(self.left_out, least=least))

    def leave(self) -> None:
        leave()


def _left_out(config: Config, sensors: Mapping[str, Any]) -> Iterator[str]:
    """Returns the topics that this host cannot publish because a message package is missing, as text."""
    if start_is_lost(config.start):
        yield "no transforms, nor the one from map to its start: this host lacks tf2_msgs"
    elif TFMessage is None:
        yield "no transforms: this host lacks tf2_msgs"
    if ros_sensors.sensor_msgs is not None:
        return
    missing = [one.name for one in config.sensors if one.rate > 0 and one.kind != "wheels"]
    missing = [name for name in missing if name not in sensors]
    missing += ["joint_states"] if config.kinematics.wheel_radius is not None else []
    missing += [f"{one.name}/*" for one in config.sensors if one.rate > 0 and one.kind == "range"]
    if missing:
        yield f"no {', '.join(missing)}: this host lacks sensor_msgs"
