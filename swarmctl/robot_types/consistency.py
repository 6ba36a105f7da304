"""Cross-field consistency checks of a robot type: parts that are valid alone and do not fit together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

from swarmctl.field_types import KEY, ConsistencyError
from swarmctl.robot_types.actuators import Actuator
from swarmctl.robot_types.binary_protocol import value_range
from swarmctl.robot_types.kinematics import Kinematics
from swarmctl.robot_types.line_protocol import SIDES
from swarmctl.robot_types.protocols import DriverProtocol, LineProtocol, RosserialProtocol
from swarmctl.robot_types.sensors import FRAME_TOPICS, ODOM, SENSORS, Battery, Sensor
from swarmctl.robot_types.settings import DIAGNOSTICS, RobotSettings
from swarmctl.robot_types.sketch_settings import SKETCH_BOUNDS, clashes

_A_FAMILY = 3  # as many replies show a rule of the protocol
# What is compared with a part of a type, where an error points at that part.
_COMPARED = {
    "kinematics": frozenset({"kinematics", "protocol"}),
    "protocol": frozenset({"kinematics", "protocol", "sensors"}),
    "sensors": frozenset({"protocol", "sensors", "actuators"}),
    "actuators": frozenset({"protocol", "sensors", "actuators"}),
    "settings": frozenset({"sensors", "settings"}),
    "firmware_dead_man": frozenset({"protocol"}),
}


class Parts(Protocol):
    """The parts of a robot type that have to agree; ``RobotType`` is one."""

    @property
    def kinematics(self) -> Kinematics:
        """Wheels, gear and limits."""

    @property
    def driver_protocol(self) -> DriverProtocol | None:
        """The protocol of swarmctl's driver; None if it has none."""

    @property
    def sketch(self) -> RosserialProtocol | None:
        """The rosserial protocol; None for other robots."""

    @property
    def sensors(self) -> Mapping[str, Sensor]:
        """The sensors by name."""

    @property
    def actuators(self) -> Mapping[str, Actuator]:
        """The actuators by name."""

    @property
    def settings(self) -> RobotSettings:
        """The default settings."""

    @property
    def firmware_dead_man(self) -> bool:
        """True if the firmware stops the robot by itself."""


def inconsistencies(robot_type: Parts) -> Iterator[ConsistencyError]:
    """Yields one error per contradiction, without those that another one causes."""
    for error in _all_errors(robot_type):
        error.parts = _COMPARED[str(error.at[0])]
        yield error


def _all_errors(robot_type: Parts) -> Iterator[ConsistencyError]:
    if robot_type.driver_protocol is not None:
        yield from _line_errors(robot_type, robot_type.driver_protocol)
    elif robot_type.sketch is not None:
        yield from _sketch_errors(robot_type, robot_type.sketch)
    if robot_type.settings.battery and not any(
        isinstance(one, Battery) for one in robot_type.sensors.values()
    ):
        yield ConsistencyError(
            "no topic of a sketch is read as a battery; take it out"
            if robot_type.sketch
            else "none of the `sensors` is of kind `battery`; add one, or take it out",
            "settings", "battery", KEY,
        )  # fmt: skip
    misnamed = any(_name_errors(robot_type))
    for name in robot_type.settings.rates if not misnamed else ():
        if name not in robot_type.sensors and name != DIAGNOSTICS:
            yield ConsistencyError(
                f"`settings` have a rate for `{name}`, which is none of the `sensors`",
                "settings", "rates", name, KEY,
            )  # fmt: skip


def _line_errors(robot_type: Parts, protocol: DriverProtocol) -> Iterator[ConsistencyError]:
    yield from _name_errors(robot_type)
    of_kinds = [
        error
        for kind in SENSORS.values()
        for error in kind.type_errors(robot_type.sensors, protocol, robot_type.settings)
    ]
    yield from of_kinds[:1]
    yield from _reading_errors(robot_type, protocol, with_cameras=not of_kinds)
    yield from _request_errors(protocol)
    yield from _actuator_errors(robot_type, protocol)
    yield from _speed_range_errors(robot_type, protocol)
    for name, query in protocol.queries.items():
        if query.firmware is not None and not protocol.identify:
            yield ConsistencyError(
                "the driver must request the firmware version first; add `identify`",
                "protocol", "queries", name, "firmware",
            )  # fmt: skip
    scales = robot_type.kinematics.scales
    if not scales:
        yield ConsistencyError("the robot has units of its own; add `kinematics.scales`", "kinematics", KEY)
    if len(scales) > 1 and not protocol.identify:
        yield ConsistencyError(
            "with several `scales` the driver must request the firmware version; add `identify`",
            "protocol", "identify",
        )  # fmt: skip


def _name_errors(robot_type: Parts) -> Iterator[ConsistencyError]:
    sensors, actuators = robot_type.sensors, robot_type.actuators
    taken = {*FRAME_TOPICS, DIAGNOSTICS}
    for group, names, others in (("sensors", sensors, taken), ("actuators", actuators, {*taken, *sensors})):
        for name in names:
            if name in others:
                yield ConsistencyError(
                    f"the name `{name}` is taken; give the topic another one", group, name, KEY
                )
    for name, sensor in sensors.items():
        if (sensor.kind == "wheels") != (name == ODOM):
            yield ConsistencyError(
                f"position counters, and nothing else, are called `{ODOM}`; rename `{name}`",
                "sensors", name, KEY,
            )  # fmt: skip


def _reading_errors(
    robot_type: Parts, protocol: DriverProtocol, *, with_cameras: bool
) -> Iterator[ConsistencyError]:
    sensors = {name: one for name, one in robot_type.sensors.items() if with_cameras or not one.settings_key}
    for name, sensor in sensors.items():
        query = protocol.queries.get(sensor.read or name)
        if query is None:
            yield ConsistencyError(
                f"sensor `{name}` reads `{sensor.read or name}`, which is none of the `queries`; "
                f"add it there, or name one of {', '.join(protocol.queries) or 'none yet'} under `read`",
                "sensors", name, "read",
            )  # fmt: skip
        elif not sensor.settings_key and sensor.first + sensor.count > query.values:
            yield ConsistencyError(
                f"the reply to `{sensor.read or name}` has {query.values} values, sensor `{name}` takes "
                f"{sensor.count} from number {sensor.first} on; correct `first`, or the query's values",
                "sensors", name, "first",
            )  # fmt: skip
    used = {sensor.read or name for name, sensor in robot_type.sensors.items()}
    is_open = not with_cameras or not used <= set(protocol.queries)  # a query without sensor may be meant
    for idle in [name for name in protocol.queries if name not in used and not is_open]:
        yield ConsistencyError(
            f"no sensor reads the query `{idle}`; add one to `sensors`, or take the query out",
            "protocol", "queries", idle, KEY,
        )  # fmt: skip


def _request_errors(protocol: DriverProtocol) -> Iterator[ConsistencyError]:
    """Queries that were copied and not changed: one request for two things, or the reply of another query."""
    if protocol.kind == "python":
        return
    first: dict[str, str] = {}
    for name, query in protocol.queries.items():
        earlier = first.setdefault(" ".join(query.send.split()), name)
        if earlier != name:
            yield ConsistencyError(
                f"the queries `{earlier}` and `{name}` send one request, `{query.send}`; correct one of them,"
                f" or remove `{name}` and let its sensors `read` `{earlier}`",
                "protocol", "queries", name, "send",
            )  # fmt: skip
    if protocol.kind == "line":
        yield from _copied_replies(protocol)


def _copied_replies(protocol: LineProtocol) -> Iterator[ConsistencyError]:
    """In K-Team's family of protocols a reply begins with the request's letter in lower case."""
    replies = {name: (one.send[:1].lower(), one.reply) for name, one in protocol.queries.items()}
    usual = {reply: name for name, (letter, reply) in replies.items() if letter == reply}
    if len(usual) < _A_FAMILY:
        return
    for name, (letter, reply) in replies.items():
        if letter != reply and reply in usual:
            yield ConsistencyError(
                f"the reply to `{name}` begins with `{reply}`, as that to `{usual[reply]}`; the other "
                f"replies begin with the letter of their request, here `{letter}`",
                "protocol", "queries", name, "reply",
            )  # fmt: skip


def _actuator_errors(robot_type: Parts, protocol: DriverProtocol) -> Iterator[ConsistencyError]:
    for name, actuator in robot_type.actuators.items():
        wrong = ""
        if protocol.kind == "python":
            if actuator.send is not None:
                wrong = f"the class of the protocol writes the requests; remove `send` of actuator `{name}`"
        elif actuator.send is None:
            wrong = f"`send` of actuator `{name}` is missing; write the request for one channel"
        elif actuator.binary != (protocol.kind == "binary"):
            wrong = f"`send` of actuator `{name}` is not written for a protocol of kind `{protocol.kind}`"
        if wrong:
            yield ConsistencyError(wrong, "actuators", name, KEY if actuator.send is None else "send")


def _speed_range_errors(robot_type: Parts, protocol: DriverProtocol) -> Iterator[ConsistencyError]:
    kinematics = robot_type.kinematics
    if protocol.kind != "binary" or not kinematics.scales:
        return
    lowest, highest = value_range(protocol.set_speed.send, *SIDES)
    units = kinematics.wheel_speed_max * max(one.speed_units_per_mps for one in kinematics.scales)
    if round(units) > min(-lowest, highest):
        yield ConsistencyError(
            f"`wheel_speed_max` is {units:g} units of speed, and `set_speed` holds {lowest:g} to "
            f"{highest:g}; use a larger layout, like {{left:i}}, or correct `scales`",
            "kinematics", "wheel_speed_max",
        )  # fmt: skip


def _sketch_errors(robot_type: Parts, sketch: RosserialProtocol) -> Iterator[ConsistencyError]:
    kinematics = robot_type.kinematics
    if kinematics.scales:
        yield ConsistencyError(
            "a sketch takes commands in m/s and rad/s; remove `kinematics.scales`",
            "kinematics", "scales", KEY,
        )  # fmt: skip
    if robot_type.sensors or robot_type.actuators:
        yield ConsistencyError(
            "a sketch's topics are under `protocol`; remove `sensors` and `actuators`",
            "sensors" if robot_type.sensors else "actuators", KEY,
        )  # fmt: skip
    if sketch.firmware:
        yield from _shipped_sketch_errors(robot_type)
    if sketch.odometry and kinematics.wheel_radius is None:
        yield ConsistencyError(
            "`odometry` needs `kinematics.wheel_radius`; add it",
            "kinematics", KEY,
        )  # fmt: skip
    if not robot_type.firmware_dead_man:
        yield ConsistencyError(
            "nothing but the sketch stops a rosserial robot whose line breaks; build a dead-man into it,"
            " and write `firmware_dead_man: true`",
            "firmware_dead_man",
        )


def _shipped_sketch_errors(robot_type: Parts) -> Iterator[ConsistencyError]:
    if robot_type.kinematics.wheel_radius is None:
        yield ConsistencyError(
            "a sketch divides by the wheels' radius; add `kinematics.wheel_radius`", "kinematics", KEY
        )
    for key, (least, most) in SKETCH_BOUNDS.items():
        value = getattr(robot_type.kinematics, key)
        if value is not None and not least <= value <= most:
            yield ConsistencyError(
                f"swarmctl's sketch is made for a `{key}` of {least:g} to {most:g}", "kinematics", key
            )
    declared = robot_type.settings.firmware
    for second, first, pin in clashes(declared):
        at = second if getattr(getattr(declared, second[0]), second[1]) is not None else first
        yield ConsistencyError(
            f"pin {pin} has two uses, `{'.'.join(first)}` and `{'.'.join(second)}`",
            "settings", "firmware", *at,
        )  # fmt: skip
