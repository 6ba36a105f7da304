"""The nodes of a healthy graph, with their topics; message types are named as in a spec. Pure."""

from __future__ import annotations

from dataclasses import replace

from swarmctl.render.driver_config import set_parameters
from swarmctl.render.gate_config import REPORTS as GATE_REPORTS
from swarmctl.render.middleware import ExpectedDriver, ExpectedGate, ExpectedNode
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import Topic
from swarmctl.spec import program_model as model
from swarmctl.swarm import names
from swarmctl.swarm.resolved import ForeignDriver, Program, Robot, Swarm, SwarmctlDriver
from swarmctl.swarm.topics import (
    DIAGNOSTICS,
    DIAGNOSTICS_TYPE,
    DriverTopic,
    sendable,
)


def driver(swarm: Swarm, robot: Robot) -> ExpectedDriver:
    """Returns the node of a driver, whichever of the drivers it is."""
    return ExpectedDriver(
        unit=names.unit(swarm.name, robot.name),
        node=_node(robot),
        topics=_published(robot),
        command=robot.command.topic if robot.command is not None else "",
        command_type=robot.command_type,
        guarded=isinstance(robot.driver, SwarmctlDriver),
        gate=_gate(swarm, robot, robot.driver) if isinstance(robot.driver, ForeignDriver) else None,
        ungated=(robot.driver.ros.reason or "") if isinstance(robot.driver, ForeignDriver) else "",
        parameters=set_parameters(robot, robot.driver) if isinstance(robot.driver, SwarmctlDriver) else {},
        provides=_provided(robot.driver.ros, robot.driver_node)
        if isinstance(robot.driver, ForeignDriver)
        else (),
    )


def _gate(swarm: Swarm, robot: Robot, driver: ForeignDriver) -> ExpectedGate | None:
    if not driver.gated:
        return None
    return ExpectedGate(
        unit=names.unit(swarm.name, robot.name, names.GATE_NODE),
        node=robot.gate_node,
        output=f"{robot.namespace}/{names.GATE_OUTPUT}",
        output_type=driver.ros.command_type,
        reports=DriverTopic(DIAGNOSTICS, DIAGNOSTICS_TYPE, GATE_REPORTS),
    )


def _node(robot: Robot) -> str:
    """Returns the node of a driver, unless it names its nodes itself."""
    driver = robot.driver
    return "" if isinstance(driver, ForeignDriver) and driver.ros.names_its_nodes else robot.driver_node


def _published(robot: Robot) -> tuple[DriverTopic, ...]:
    """What the driver publishes; one topic per reading."""
    relative = [one for one in robot.topics if not one.part]
    return tuple(
        topic if topic.name.startswith("/") else replace(topic, name=f"{robot.namespace}/{topic.name}")
        for topic in relative
    )


def program(swarm: Swarm, program: Program) -> ExpectedNode:
    """Returns the node of a program, unless it names its nodes itself or does not run for good."""
    declared = program.declared
    commanded = program.commands if declared.use is not None else ()
    commands = ((one.topic, one.type) for one in sendable(commanded, swarm.command_topics))
    return ExpectedNode(
        names.unit(swarm.name, program.name),
        program.node if declared.names_its_node and declared.lifecycle == "service" else "",
        publishes=(*_topics(program, declared.publishes), *commands),
        subscribes=_topics(program, declared.subscribes),
        measured=tuple(
            DriverTopic(_full_name(program, one), one.type, one.rate)
            for one in declared.publishes
            if one.rate is not None
        ),
        provides=_provided(declared, program.node),
    )


def _provided(declared: RosDriver | model.Program, node: str) -> tuple[tuple[str, str], ...]:
    return tuple((names.resolved(one.name, node, declared.remap), one.type) for one in declared.provides)


def _topics(program: Program, topics: tuple[Topic, ...]) -> tuple[tuple[str, str], ...]:
    return tuple((_full_name(program, one), one.type) for one in topics)


def _full_name(program: Program, topic: Topic) -> str:
    return names.resolved(topic.topic, program.node, program.declared.remap)
