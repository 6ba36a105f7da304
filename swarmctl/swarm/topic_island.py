"""Which island a topic belongs to, and which robot takes its commands from it. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.robot_types.ros_driver import VELOCITIES
from swarmctl.swarm import names
from swarmctl.swarm.resolve import power_topics
from swarmctl.swarm.resolved import Commander, Island, Robot, Swarm, SwarmctlDriver
from swarmctl.swarm.topics import MESSAGES


def full_name(topic: str) -> str:
    """Returns a topic with one slash in front of each of its words, as a graph has it."""
    return "/" + "/".join(filter(None, topic.split("/")))


def island_of_topic(swarm: Swarm, topic: str) -> Island | None:
    """Returns the island of the robot in whose namespace ``topic`` is, else the only one; None if unknown."""
    robots = {one.namespace: one for one in swarm.robots.values()}
    for namespace in names.above(topic):
        if namespace in robots:
            return swarm.island_of(robots[namespace].host)
    return swarm.islands[0] if len(swarm.islands) == 1 else None


def commanded_by(swarm: Swarm, topic: str) -> Robot | None:
    """Returns the robot that takes commands on ``topic``, if one does."""
    for name, command in swarm.command_topics.items():
        if command.topic == topic:
            return swarm.robots[name]
    return None


def behind_gate(swarm: Swarm, topic: str) -> Robot | None:
    """Returns the robot whose gate alone publishes ``topic``, if one does."""
    outputs = {f"{one.namespace}/{names.GATE_OUTPUT}": one for one in swarm.robots.values() if one.gated}
    return outputs.get(topic)


def is_guarded(robot: Robot) -> bool:
    """True if its driver or its gate rejects commands of nodes that may not command it."""
    return robot.gated or isinstance(robot.driver, SwarmctlDriver)


def commander_at(robot: Robot, address: str) -> Commander | None:
    """Returns the first commander of ``robot`` to which every node at ``address`` belongs, if one does."""
    return next((one for one in robot.commanders if one.includes("", address)), None)


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
