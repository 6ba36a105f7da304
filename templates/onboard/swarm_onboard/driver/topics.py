"""The driver as a node of ROS: subscribes to commands and settings of actuators, publishes data."""

from __future__ import annotations

from typing import Any, Iterator, Mapping

from std_msgs.msg import UInt8, UInt8MultiArray

from swarm_onboard.command.command_gate import CommandGate
from swarm_onboard.command.diagnostics import Diagnostics
from swarm_onboard.command.report import Level, Report
from swarm_onboard.command.transforms import TFMessage, start_is_lost
from swarm_onboard.driver import frames, sensor_topics
from swarm_onboard.driver.actuators import ActuatorSettings
from swarm_onboard.driver.codec import Values
from swarm_onboard.driver.config import Actuator, Config, Sensor
from swarm_onboard.driver.kinematics import Pose
from swarm_onboard.driver.motion_topics import MotionTopics
from swarm_onboard.ros.node import Node


def show_parameters(node: Node, config: Config) -> Iterator[str]:
    """Shows what the driver works with; what it works with stays as its parameter file has it.

    Yields what could not be shown.
    """
    try:
        node.set_parameters(config.shown)
    except Exception as error:  # noqa: BLE001  the robot drives without them
        yield f"no parameters: {error}"


def describe(node: Node, config: Config) -> Iterator[str]:
    """Shows the robot's description. Yields why it could not be shown."""
    try:
        if config.urdf is not None:
            node.describe(config.urdf.read_text("utf-8"))
    except Exception as error:  # noqa: BLE001  the robot drives without it
        yield f"no robot_description: {error}"


def subscribe_to_settings(
    node: Node, actuator: Actuator, senders: CommandGate, outputs: ActuatorSettings
) -> None:
    """Subscribes to a number for one channel, to a list with one number each for several."""
    single = len(actuator.channels) == 1

    def take(sender: str, host: str | None, setting: Any) -> None:
        if senders.admits_setting(sender, host):
            outputs.put(actuator, [setting.data] if single else list(setting.data))

    node.subscribe_to_settings(actuator.name, UInt8 if single else UInt8MultiArray, take)


class DriverTopics:
    """Publishes a driver's data. ``left_out`` is what could not be shown or published, as text."""

    def __init__(self, node: Node, config: Config) -> None:
        self._config = config
        self._node = node
        named = frames.Frames(config)
        self._motion = MotionTopics(node, config, named)
        self._sensors = sensor_topics.topics_of(node, config, named)
        self._places = frames.publish_places(node, config, named)
        self._diagnostics = Diagnostics(node, f"{config.robot}: driver", f"{config.title} {config.robot}")
        self._unpublished = (*_left_out(config, self._sensors), *describe(node, config))
        self.left_out = (*self._unpublished, *show_parameters(node, config))

    def take(self, config: Config) -> None:
        """Shows the live values of ``config``, with which the driver works now."""
        sensor_topics.retime(self._sensors, config)
        self.left_out = (*self._unpublished, *show_parameters(self._node, config))

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
        self._node.leave()


def _left_out(config: Config, sensors: Mapping[str, Any]) -> Iterator[str]:
    """Returns the topics that this host cannot publish because a message package is missing, as text."""
    if start_is_lost(config.start):
        yield "no transforms, nor the one from map to its start: this host lacks tf2_msgs"
    elif TFMessage is None:
        yield "no transforms: this host lacks tf2_msgs"
    if sensor_topics.sensor_msgs is not None:
        return
    missing = [one.name for one in config.sensors if one.rate > 0 and one.kind != "wheels"]
    missing = [name for name in missing if name not in sensors]
    missing += ["joint_states"] if config.kinematics.wheel_radius is not None else []
    missing += [f"{one.name}/*" for one in config.sensors if one.rate > 0 and one.kind == "range"]
    if missing:
        yield f"no {', '.join(missing)}: this host lacks sensor_msgs"
