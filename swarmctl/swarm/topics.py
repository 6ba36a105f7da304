"""Which topics drivers publish (by robot type) and programs publish or subscribe to (as declared)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.robot_types.driver_params import equipped, rates_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.sensors import ODOM, SCAN, Quantity, Range, Raw, Sensor
from swarmctl.robot_types.settings import DIAGNOSTICS as DIAGNOSTICS_RATE
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.robot_types.sketch_settings import size_of
from swarmctl.spec.catalog import shipped
from swarmctl.spec.model import Spec
from swarmctl.spec.program_model import Program
from swarmctl.swarm import names
from swarmctl.swarm.command_topics import SENDABLE, CommandTopic
from swarmctl.swarm.shipped_programs import SHIPPED

DIAGNOSTICS, CLOCK = "/diagnostics", "/clock"
DIAGNOSTICS_TYPE = "diagnostic_msgs/DiagnosticArray"
JOINTS = "joint_states"
WHEEL_JOINTS = ("left_wheel", "right_wheel")  # as swarmctl's driver names them in `joint_states`
MESSAGES = {  # of the topic with a sensor's readings
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
_SCAN_TYPE, _SCAN_BYTES = "sensor_msgs/LaserScan", 4 * 72
_OF_A_CAMERA = "sensor_msgs/CameraInfo"
_ONE_CHANNEL, _CHANNELS = "std_msgs/UInt8", "std_msgs/UInt8MultiArray"
_RANGE, _JOINT_STATE = "sensor_msgs/Range", "sensor_msgs/JointState"
_JOINTS_BYTES = 2 * (4 + len("right_wheel")) + 4 * 8  # two names, their positions and velocities
JOY_TYPE = "sensor_msgs/Joy"
_JOY_NODE, _JOY_READER = ("joy", "joy_node"), ("teleop_twist_joy", "teleop_node")
_GRAPH_NAME = re.compile("[A-Za-z/][A-Za-z0-9_/]*", re.ASCII)
_LAYOUT = 24  # bytes of a list of numbers around its label and its numbers

Loc = tuple[str | int, ...]


@dataclass(frozen=True)
class Endpoint:
    """A node that publishes a topic or subscribes to it. ``loc`` is where the spec declares that."""

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
    """A topic that a driver publishes, relative to its robot's namespace unless it begins with /."""

    name: str
    type: str
    rate: float  # Hz; 0 if unknown
    size: int = 0  # bytes; 0 if unknown
    part: bool = False  # computed from the same reading as another topic, at the same rate


def driver_topics(robot_type: RobotType, settings: RobotSettings) -> tuple[DriverTopic, ...]:
    """What swarmctl's driver publishes with these merged ``settings``, without sensors that are off."""
    rates, robot_type = rates_of(robot_type, settings), equipped(robot_type, settings)
    on = [name for name in robot_type.sensors if rates[name] > 0]
    sensed = [one for name in on for one in _of_sensor(robot_type, name, rates[name])]
    return (
        *_of_sketch(robot_type),
        *_counted(robot_type),
        *sensed,
        DriverTopic(DIAGNOSTICS, DIAGNOSTICS_TYPE, rates[DIAGNOSTICS_RATE]),
    )


def sensors_of(robot_type: RobotType) -> Mapping[str, str]:
    """The message types of all sensor topics of swarmctl's driver, on or off, by name in its namespace."""
    sensed = [one for name in robot_type.sensors for one in _of_sensor(robot_type, name, 0.0)]
    return {one.name: one.type for one in (*_of_sketch(robot_type), *_counted(robot_type), *sensed)}


def declared_topics(driver: RosDriver, node: str) -> tuple[DriverTopic, ...]:
    """The topics that a ROS package is declared to publish; ``node`` is the full name of its node."""
    space = node.rpartition("/")[0] + "/"
    return tuple(
        DriverTopic(
            names.resolved(one.topic, node, driver.remap).removeprefix(space),
            one.type,
            one.rate or 0.0,
            one.size or _bytes(one.type),
        )
        for one in driver.publishes
    )


def actuators_of(robot_type: RobotType) -> Mapping[str, str]:
    """Returns the message types of the actuator topics of a driver, by name in its namespace."""
    return {
        name: _ONE_CHANNEL if len(one.channels) == 1 else _CHANNELS
        for name, one in robot_type.actuators.items()
    }


def topic_of(name: str, kind: str) -> str:
    """Returns the topic with the readings of the sensor ``name``; images come where ROS expects them."""
    return f"{name}/image_raw" if kind == "image" else name


def sensor_behind(topic: str) -> str:
    """Returns the sensor behind a topic of a driver."""
    if topic == JOINTS:
        return ODOM
    return topic.partition("/")[0]


def _of_sketch(robot_type: RobotType) -> Iterator[DriverTopic]:
    for one in robot_type.sketch.publishes if robot_type.sketch else ():
        if one.rate is not None:
            yield DriverTopic(one.topic, one.type, one.rate, one.size or _bytes(one.type))


def _counted(robot_type: RobotType) -> Iterator[DriverTopic]:
    """What swarmctl's driver computes from a sketch's encoder counts: one pose for each pair of counts."""
    sketch = robot_type.sketch
    if sketch is not None and sketch.odometry is not None:
        rates = {one.topic: one.rate or 0.0 for one in sketch.publishes}
        message = MESSAGES["wheels"]
        rate = min(rates[sketch.odometry.left], rates[sketch.odometry.right])
        yield DriverTopic(ODOM, message, rate, _bytes(message))
        yield from _joints(robot_type, rate)


def _of_sensor(robot_type: RobotType, name: str, rate: float) -> Iterator[DriverTopic]:
    sensor = robot_type.sensors[name]
    yield DriverTopic(topic_of(name, sensor.kind), MESSAGES[sensor.kind], rate, _sensor_bytes(sensor))
    if sensor.kind == "image":
        yield DriverTopic(f"{name}/camera_info", _OF_A_CAMERA, rate, _bytes(_OF_A_CAMERA), part=True)
    if isinstance(sensor, Range):
        if len(sensor.elements) > 1:
            yield DriverTopic(f"{name}/{SCAN}", _SCAN_TYPE, rate, _bytes(_SCAN_TYPE) + _SCAN_BYTES, part=True)
        for one in sensor.elements:
            yield DriverTopic(f"{name}/{one.name}", _RANGE, rate, _bytes(_RANGE), part=True)
    if sensor.kind == "wheels":
        yield from _joints(robot_type, rate)


def _joints(robot_type: RobotType, rate: float) -> Iterator[DriverTopic]:
    if robot_type.kinematics.wheel_radius is not None:
        yield DriverTopic(JOINTS, _JOINT_STATE, rate, _bytes(_JOINT_STATE) + _JOINTS_BYTES, part=True)


def _sensor_bytes(sensor: Sensor) -> int:
    """Bytes of a sensor's message; numbers without one of their own are a list labelled with their names."""
    match sensor:
        case Range(elements=elements):
            return _list_bytes([one.name for one in elements], 2)
        case Raw(names=names):
            return _list_bytes(names, 2)
        case Quantity(names=names):
            return _list_bytes(names, 4)
    return _bytes(MESSAGES[sensor.kind]) + sensor.payload


def _list_bytes(names: Sequence[str], each: int) -> int:
    return _LAYOUT + sum(len(name) + 1 for name in names) + each * len(names)


def _bytes(type_name: str) -> int:
    size = size_of(type_name)
    return size.bytes if size else 0


def program_endpoints(
    spec: Spec,
    hosts: Mapping[str, str | None],
    nodes: Mapping[str, str],
    commands: Mapping[str, CommandTopic],
) -> Iterator[Endpoint]:
    """Every topic that programs publish or subscribe to, under its full name.

    ``hosts`` and ``nodes`` are by program, ``commands`` is the command topic by robot.

    These are the declared topics, the commands that the shipped programs publish, and the gamepad's state
    between a `joy_node` and what drives by it.
    """
    commanded = _commanded(spec)
    for name, program in spec.programs.items():
        host = hosts[name] or ""
        node = nodes[name]
        for key, topics in (("publishes", program.publishes), ("subscribes", program.subscribes)):
            for index, declared in enumerate(topics):
                full = names.resolved(declared.topic, node, program.remap)
                loc = ("programs", name, key, index)
                publishes = key == "publishes"
                yield Endpoint(
                    full, declared.type, publishes, node, host, name, declared.rate, declared.size, loc
                )
        for one in sendable(commanded.get(name, ()), commands):
            rate = _command_rate(program)
            yield Endpoint(one.topic, one.type, True, node, host, name, rate, None, ("programs", name))
        if (joy := _joy_topic(program)) is not None:
            full, publishes = names.resolved(joy, node, program.remap), program.package == _JOY_NODE[0]
            place: Loc = (
                ("programs", name, "params") if program.use and program.params else ("programs", name)
            )
            yield Endpoint(full, JOY_TYPE, publishes, node, host, name, None, None, place)


def sendable(robots: Iterable[str], commands: Mapping[str, CommandTopic]) -> Iterator[CommandTopic]:
    """Yields the command topics of those ``robots`` that a shipped program can command."""
    found = (commands[robot] for robot in robots if robot in commands)
    return (one for one in found if one.type in SENDABLE)


def _joy_topic(program: Program) -> str | None:
    """The topic of the gamepad that a program has without declaring it."""
    if program.use == "teleop-joy" and program.package is None:
        topic, device = (program.params.get(key, "") for key in ("topic", "device"))
        default = str(shipped()[program.use]["topic"].default)
        named = topic if isinstance(topic, str) and _GRAPH_NAME.fullmatch(topic) else default
        declared = any(one.type == JOY_TYPE for one in program.subscribes)
        return None if device or declared else named
    declared = bool(program.use or program.publishes or program.subscribes)
    known = (program.package, program.executable) in (_JOY_NODE, _JOY_READER)
    return "joy" if known and not declared else None


def _commanded(spec: Spec) -> dict[str, dict[str, None]]:
    """The robots that each shipped program commands: it publishes to each, without a declaration."""
    found: dict[str, dict[str, None]] = {
        name: {} for name, one in spec.programs.items() if one.use in SHIPPED
    }
    for control in spec.control if found else ():
        if control.by in found:
            found[control.by].update(dict.fromkeys(robot for robot in control.of if robot in spec.robots))
    return found


def _command_rate(program: Program) -> float | None:
    """How often a shipped program publishes a command, Hz; None if `params.rate` is not valid."""
    setting = shipped()[program.use or ""]["rate"]
    rate = program.params.get("rate", setting.default)
    return float(rate) if setting.takes(rate) else None
