"""Who publishes and who hears which topic: drivers by their type, programs as the spec says."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.spec.messages import size_of
from swarmctl.spec.model import Program, Spec
from swarmctl.spec.protocols import DriverName
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.sensors import ODOM, Image, Quantity, Range, Raw, Sensor
from swarmctl.spec.settings import DIAGNOSTICS as DIAGNOSTICS_RATE
from swarmctl.spec.settings import RobotSettings
from swarmctl.spec.shipped import shipped
from swarmctl.spec.tuning import equipped, rates_of
from swarmctl.topology import modes, names
from swarmctl.topology.programs import SHIPPED

COMMAND = "cmd_vel"
COMMAND_TYPE = "geometry_msgs/Twist"
DIAGNOSTICS = "/diagnostics"
DIAGNOSTICS_TYPE = "diagnostic_msgs/DiagnosticArray"
JOINTS = "joint_states"
MESSAGES = {  # of the topic that is called as its sensor
    "wheels": "nav_msgs/Odometry",
    "range": "std_msgs/UInt16MultiArray",
    "raw": "std_msgs/UInt16MultiArray",
    "quantity": "std_msgs/Float32MultiArray",
    "imu": "sensor_msgs/Imu",
    "magnetic": "sensor_msgs/MagneticField",
    "battery": "sensor_msgs/BatteryState",
    "temperature": "sensor_msgs/Temperature",
    "image": "sensor_msgs/Image",
}
_ONE_CHANNEL, _CHANNELS = "std_msgs/UInt8", "std_msgs/UInt8MultiArray"
_RANGE, _JOINT_STATE = "sensor_msgs/Range", "sensor_msgs/JointState"
_JOINTS_BYTES = 2 * (4 + len("right_wheel")) + 4 * 8  # two names, their positions and velocities
_SENT = {"mono8": ("mono8", 1), "rgb565": ("rgb8", 3)}  # what an image is sent as, bytes a pixel
_LAYOUT = 24  # bytes of a list of numbers around its label and its numbers

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
    size: int = 0  # bytes; 0 where that is open
    part: bool = False  # made from the same reading as another topic, and as often


def driver_topics(
    robot_type: RobotType, settings: RobotSettings, driver: DriverName
) -> tuple[DriverTopic, ...]:
    """What a driver publishes with these merged ``settings``; a sensor that is turned off is left out.

    `rosserial_python` publishes what its sketch does; it has diagnostics only when something goes wrong.
    """
    said = tuple(_of_sketch(robot_type))
    if robot_type.foreign(driver):
        return said
    rates, robot_type = rates_of(robot_type, settings), equipped(robot_type, settings)
    on = [name for name in robot_type.sensors if rates[name] > 0]
    sensed = [one for name in on for one in _of_sensor(robot_type, name, rates[name])]
    return (
        *said,
        *_counted(robot_type),
        *sensed,
        DriverTopic(DIAGNOSTICS, DIAGNOSTICS_TYPE, rates[DIAGNOSTICS_RATE]),
    )


def sensors_of(robot_type: RobotType, driver: DriverName) -> Mapping[str, str]:
    """The message types of what a driver has of sensors, turned off or not, by topic in its namespace."""
    counted = () if robot_type.foreign(driver) else _counted(robot_type)
    sensed = [one for name in robot_type.sensors for one in _of_sensor(robot_type, name, 0.0)]
    return {one.name: one.type for one in (*_of_sketch(robot_type), *counted, *sensed)}


def actuators_of(robot_type: RobotType) -> Mapping[str, str]:
    """The message types of what a driver hears beside orders, by topic in its robot's namespace."""
    return {
        name: _ONE_CHANNEL if len(one.channels) == 1 else _CHANNELS
        for name, one in robot_type.actuators.items()
    }


def sensor_behind(topic: str) -> str:
    """The sensor that a topic of a driver is made from."""
    if topic == JOINTS:
        return ODOM
    return topic.partition("/")[0]


def _of_sketch(robot_type: RobotType) -> Iterator[DriverTopic]:
    for one in robot_type.sketch.publishes if robot_type.sketch else ():
        if one.rate is not None:
            yield DriverTopic(one.topic, one.type, one.rate, one.size or _bytes(one.type))


def _counted(robot_type: RobotType) -> Iterator[DriverTopic]:
    """What our driver makes of a sketch's counts: a pose of each pair."""
    sketch = robot_type.sketch
    if sketch is not None and sketch.odometry is not None:
        rates = {one.topic: one.rate or 0.0 for one in sketch.publishes}
        message = MESSAGES["wheels"]
        rate = min(rates[sketch.odometry.left], rates[sketch.odometry.right])
        yield DriverTopic(ODOM, message, rate, _bytes(message))
        yield from _joints(robot_type, rate)


def _of_sensor(robot_type: RobotType, name: str, rate: float) -> Iterator[DriverTopic]:
    sensor = robot_type.sensors[name]
    message = MESSAGES[sensor.kind]
    yield DriverTopic(name, message, rate, _sensor_bytes(sensor) or _bytes(message))
    if isinstance(sensor, Range):
        for one in sensor.elements:
            yield DriverTopic(f"{name}/{one.name}", _RANGE, rate, _bytes(_RANGE), part=True)
    if sensor.kind == "wheels":
        yield from _joints(robot_type, rate)


def _joints(robot_type: RobotType, rate: float) -> Iterator[DriverTopic]:
    if robot_type.kinematics.wheel_radius is not None:
        yield DriverTopic(JOINTS, _JOINT_STATE, rate, _bytes(_JOINT_STATE) + _JOINTS_BYTES, part=True)


def _sensor_bytes(sensor: Sensor) -> int:
    """A list of numbers, labelled with their names, or an image; 0 for another message."""
    match sensor:
        case Range(elements=elements):
            return _list_bytes([one.name for one in elements], 2)
        case Raw(names=names):
            return _list_bytes(names, 2)
        case Quantity(names=names):
            return _list_bytes(names, 4)
        case Image(width=width, height=height, encoding=encoding):
            name, each = _SENT[encoding]
            return _bytes(MESSAGES["image"]) + len(name) + width * height * each
    return 0


def _list_bytes(names: Sequence[str], each: int) -> int:
    return _LAYOUT + sum(len(name) + 1 for name in names) + each * len(names)


def _bytes(type_name: str) -> int:
    size = size_of(type_name)
    return size.bytes if size else 0


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
