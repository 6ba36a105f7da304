"""The topic on which each robot takes commands: its gate's, its driver's own, or none. Pure."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

from swarmctl.robot_types.kinematics import Motion
from swarmctl.robot_types.ros_driver import VELOCITIES, RosDriver
from swarmctl.swarm import names

COMMAND = "cmd_vel"
COMMAND_TYPE = "geometry_msgs/Twist"
STAMPED_TYPE = "geometry_msgs/TwistStamped"
SENDABLE = VELOCITIES  # what the shipped teleop programs can publish


class CommandTopic(NamedTuple):
    """A topic by its full name, and the message type of the commands on it."""

    topic: str
    type: str


def is_gated(driver: RosDriver, motion: Motion) -> bool:
    """Returns True if swarmctl's gate stands in front of ``driver``: the robot moves, and has a gate."""
    return not driver.ungated and motion.kind != "none"


def command_topic(
    namespace: str,
    driver: RosDriver | None,
    motion: Motion,
    wanted: str | None,
    declared: Mapping[str, Collection[str]],
) -> CommandTopic | None:
    """Returns where the robot with this namespace takes commands; None if it takes none.

    ``driver`` is the ROS package that drives it, None for swarmctl's own driver. An ungated package takes
    commands on its own topic, which ``command``, ``command_type`` and ``remap`` of the driver name. For
    others the type is the ``wanted`` one, else that which all programs have ``declared`` for the topic.
    """
    if motion.kind == "none":
        return None
    if driver is None or is_gated(driver, motion):
        topic = f"{namespace}/{COMMAND}"
        agreed = declared[topic] if len(declared.get(topic, ())) == 1 else (COMMAND_TYPE,)
        return CommandTopic(topic, wanted or next(iter(agreed)))
    topic = names.resolved(driver.command, names.driver_node(namespace), driver.remap)
    return CommandTopic(topic, driver.command_type)
