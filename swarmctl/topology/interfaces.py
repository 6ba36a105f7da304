"""Who publishes and who hears which topic: drivers by their type, programs as the spec says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.spec.model import Program, Spec
from swarmctl.spec.robot_type import RobotSettings, RobotType, rates_of
from swarmctl.topology import modes, names

COMMAND = "cmd_vel"
COMMAND_TYPE = "geometry_msgs/Twist"
DIAGNOSTICS = "/diagnostics"
DIAGNOSTICS_TYPE = "diagnostic_msgs/DiagnosticArray"
SENSORS = {"odom": "nav_msgs/Odometry", "proximity": "std_msgs/UInt16MultiArray"}

# Topics that ROS itself, or every driver, has at the top of the graph.
COMMON = {
    DIAGNOSTICS: DIAGNOSTICS_TYPE,
    "/clock": "rosgraph_msgs/Clock",
    "/rosout": "rosgraph_msgs/Log",
    "/rosout_agg": "rosgraph_msgs/Log",
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
}

Loc = tuple[str | int, ...]


@dataclass(frozen=True)
class Endpoint:
    """One end of a topic: a node that publishes it or hears it. ``loc`` is where the spec says so."""

    topic: str
    type: str
    publishes: bool
    node: str
    host: str
    owner: str
    rate: float | None  # Hz
    size: int | None  # bytes
    loc: Loc


@dataclass(frozen=True)
class DriverTopic:
    """What every driver of one kind publishes, relative to its robot's namespace unless it begins with /."""

    name: str
    type: str
    rate: float  # Hz


def driver_topics(robot_type: RobotType, settings: RobotSettings) -> tuple[DriverTopic, ...]:
    """What a driver publishes with these merged ``settings``; a sensor that is turned off is left out."""
    rates = rates_of(robot_type, settings)
    sensors = [DriverTopic(name, kind, rates[name]) for name, kind in SENSORS.items() if rates[name] > 0]
    return (*sensors, DriverTopic(DIAGNOSTICS, DIAGNOSTICS_TYPE, rates["diagnostics"]))


def program_host(spec: Spec, program: Program) -> str | None:
    """The host a program runs on: its own, or that of the robot it belongs to."""
    if program.host is not None:
        return program.host
    return modes.driving_host(spec, program.robot) if program.robot in spec.robots else None


def program_endpoints(spec: Spec) -> Iterator[Endpoint]:
    """Every topic that a program is said to publish or to hear, under its full name."""
    for name, program in spec.programs.items():
        host = program_host(spec, program) or ""
        node = names.program_node(name, program.robot)
        for key, topics in (("publishes", program.publishes), ("subscribes", program.subscribes)):
            for index, topic in enumerate(topics):
                full = names.resolved(topic.topic, node, program.remap)
                loc = ("programs", name, key, index)
                publishes = key == "publishes"
                yield Endpoint(full, topic.type, publishes, node, host, name, topic.rate, topic.size, loc)
