"""Who publishes and who hears which topic: drivers by their type, programs as the spec says."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from swarmctl.spec.model import Program, Spec
from swarmctl.spec.robot_type import RobotSettings, RobotType, rates_of
from swarmctl.spec.shipped import shipped
from swarmctl.topology import modes, names
from swarmctl.topology.programs import SHIPPED

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
    """What a driver publishes with these merged ``settings``; a sensor that is turned off is left out.

    `rosserial_python` publishes what its sketch does; it has diagnostics only when something goes wrong.
    """
    if robot_type.sketch is not None:
        said = robot_type.sketch.publishes
        return tuple(DriverTopic(one.topic, one.type, one.rate) for one in said if one.rate is not None)
    rates = rates_of(robot_type, settings)
    sensors = [DriverTopic(name, kind, rates[name]) for name, kind in SENSORS.items() if rates[name] > 0]
    return (*sensors, DriverTopic(DIAGNOSTICS, DIAGNOSTICS_TYPE, rates["diagnostics"]))


def sensors_of(robot_type: RobotType) -> Mapping[str, str]:
    """The message types of what a driver has of sensors, turned off or not, by topic in its namespace."""
    if robot_type.sketch is not None:
        return {one.topic: one.type for one in robot_type.sketch.publishes}
    return SENSORS


def program_host(spec: Spec, program: Program) -> str | None:
    """The host a program runs on: its own, its robot's, or the first that has what it needs."""
    if program.host is not None:
        return program.host
    if program.robot is not None:
        return modes.driving_host(spec, program.robot) if program.robot in spec.robots else None
    return next(able_hosts(spec, program.needs), None) if program.needs else None


def able_hosts(spec: Spec, needs: Collection[str]) -> Iterator[str]:
    """The hosts that run ROS and have all of ``needs``, in the order of the spec."""
    able = [name for name, host in spec.hosts.items() if host.has and set(needs) <= set(host.has)]
    if able:
        within = {name for island in modes.islands_of(spec) for name in island.hosts}
        yield from (name for name in able if name in within)


def program_endpoints(spec: Spec) -> Iterator[Endpoint]:
    """Every topic that programs publish or hear, under its full name: what is said, and our own's orders."""
    commanded = _commanded(spec)
    for name, program in spec.programs.items():
        host = program_host(spec, program) or ""
        node = names.program_node(name, program.robot)
        for key, topics in (("publishes", program.publishes), ("subscribes", program.subscribes)):
            for index, topic in enumerate(topics):
                full = names.resolved(topic.topic, node, program.remap)
                loc = ("programs", name, key, index)
                publishes = key == "publishes"
                yield Endpoint(full, topic.type, publishes, node, host, name, topic.rate, topic.size, loc)
        for robot in commanded.get(name, ()):
            orders, rate = f"{names.namespace(robot)}/{COMMAND}", _orders_rate(program)
            yield Endpoint(orders, COMMAND_TYPE, True, node, host, name, rate, None, ("programs", name))


def _commanded(spec: Spec) -> dict[str, dict[str, None]]:
    """The robots that shipped programs command: these publish to each, and nobody needs to say so."""
    found: dict[str, dict[str, None]] = {
        name: {} for name, one in spec.programs.items() if one.use in SHIPPED
    }
    for control in spec.control if found else ():
        if control.by in found:
            found[control.by].update(dict.fromkeys(robot for robot in control.of if robot in spec.robots))
    return found


def _orders_rate(program: Program) -> float | None:
    """Orders a second, Hz."""
    setting = shipped()[program.use or ""]["rate"]
    rate = program.params.get("rate", setting.default)
    return float(rate) if setting.takes(rate) else None
