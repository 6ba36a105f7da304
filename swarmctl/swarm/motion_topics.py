"""The topics that say how robots move, by which a recorded run is shown again. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.robot_types.ros_driver import VELOCITIES
from swarmctl.swarm.resolved import Swarm
from swarmctl.swarm.robot_maintenance import power_topics
from swarmctl.swarm.topics import MESSAGES


@dataclass(frozen=True)
class MotionTopics:
    """Full names of a robot's topics; empty for none. Its ``command`` is a Twist or a TwistStamped."""

    odometry: str
    command: str
    battery: str


def motion_topics(swarm: Swarm) -> dict[str, MotionTopics]:
    """The topics of each robot."""
    found = {}
    for name, robot in swarm.robots.items():
        odometry = next((one.name for one in robot.topics if one.type == MESSAGES["wheels"]), None)
        battery, _ = power_topics(robot.topics)
        command = robot.command
        found[name] = MotionTopics(
            robot.full_name(odometry) if odometry else "",
            command.topic if command and command.type in VELOCITIES else "",
            robot.full_name(battery) if battery else "",
        )
    return found
