"""The nodes of a healthy ROS 1 graph, with the topics that they register at their master. Pure."""

from __future__ import annotations

from dataclasses import replace

from swarmctl.render.middleware import ExpectedDriver, ExpectedNode
from swarmctl.robot_types.declared_topic import Topic
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Program, Robot, Swarm
from swarmctl.swarm.topics import (
    COMMAND,
    COMMAND_TYPE,
    DIAGNOSTICS,
    DIAGNOSTICS_TYPE,
    DriverTopic,
    driver_topics,
)

#: Topics without a namespace that ROS itself or every driver publishes.
TOPICS = {
    DIAGNOSTICS: DIAGNOSTICS_TYPE,
    "/clock": "rosgraph_msgs/Clock",
    "/rosout": "rosgraph_msgs/Log",
    "/rosout_agg": "rosgraph_msgs/Log",
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
}


def driver(swarm: Swarm, robot: Robot) -> ExpectedDriver:
    """Returns the node of a driver, whichever of the drivers it is."""
    return ExpectedDriver(
        unit=names.unit(swarm.name, robot.name),
        node=robot.driver_node,
        publishes=_published(robot),
        command=f"{robot.namespace}/{COMMAND}",
        command_type=COMMAND_TYPE,
        guarded=robot.foreign_sketch is None,
    )


def _published(robot: Robot) -> tuple[DriverTopic, ...]:
    """What the driver publishes; one topic per reading."""
    relative = [one for one in driver_topics(robot.type, robot.settings, robot.driver) if not one.part]
    return tuple(
        topic if topic.name.startswith("/") else replace(topic, name=f"{robot.namespace}/{topic.name}")
        for topic in relative
    )


def program(swarm: Swarm, program: Program) -> ExpectedNode:
    """Returns the node of a program; a launch file names its nodes itself."""
    declared = program.declared
    commanded = program.commands if declared.use is not None else ()
    commands = ((f"{names.namespace(robot)}/{COMMAND}", COMMAND_TYPE) for robot in commanded)
    return ExpectedNode(
        names.unit(swarm.name, program.name),
        program.node if declared.launch is None else "",
        publishes=(*_topics(program, declared.publishes), *commands),
        subscribes=_topics(program, declared.subscribes),
    )


def _topics(program: Program, topics: tuple[Topic, ...]) -> tuple[tuple[str, str], ...]:
    return tuple(
        (names.resolved(one.topic, program.node, program.declared.remap), one.type) for one in topics
    )
