"""What the parts of a robot type have against each other, each right by itself; and where to look."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from swarmctl.spec.binary import room_of
from swarmctl.spec.cameras import AS_BUILT, tuned
from swarmctl.spec.firmware import SKETCH_BOUNDS, clashes
from swarmctl.spec.queries import SIDES
from swarmctl.spec.sensors import FRAME_TOPICS, ODOM, Image
from swarmctl.spec.settings import DIAGNOSTICS
from swarmctl.spec.words import KEY, MisfitError

if TYPE_CHECKING:
    from swarmctl.spec.protocols import Asked, RosserialProtocol
    from swarmctl.spec.robot_type import RobotType


def misfits(robot_type: RobotType) -> Iterator[MisfitError]:
    """All of them, the ones that others follow from first."""
    if robot_type.asked is not None:
        yield from _of_a_line(robot_type, robot_type.asked)
    elif robot_type.sketch is not None:
        yield from _of_a_sketch(robot_type, robot_type.sketch)
    for name in robot_type.settings.rates:
        if name not in robot_type.sensors and name != DIAGNOSTICS:
            yield MisfitError(
                f"`settings` have a rate for `{name}`, which is none of the `sensors`",
                "settings", "rates", name, KEY,
            )  # fmt: skip


def _of_a_line(robot_type: RobotType, protocol: Asked) -> Iterator[MisfitError]:
    yield from _ill_named(robot_type)
    yield from _of_a_camera(robot_type, protocol)
    yield from _misread(robot_type, protocol)
    yield from _misset(robot_type, protocol)
    yield from _too_fast(robot_type, protocol)
    scales = robot_type.kinematics.scales
    if not scales:
        yield MisfitError("wheels count in the robot's own units; add `kinematics.scales`", "kinematics", KEY)
    if len(scales) > 1 and not getattr(protocol, "identify", None):
        yield MisfitError(
            "with more than one entry in `scales` the driver must ask for the firmware: add `identify`",
            "protocol", "identify",
        )  # fmt: skip


def _ill_named(robot_type: RobotType) -> Iterator[MisfitError]:
    sensors, actuators = robot_type.sensors, robot_type.actuators
    taken = {*FRAME_TOPICS, DIAGNOSTICS}
    for room, names, others in (("sensors", sensors, taken), ("actuators", actuators, {*taken, *sensors})):
        for name in names:
            if name in others:
                yield MisfitError(f"the name `{name}` is taken; give the topic another one", room, name, KEY)
    for name, sensor in sensors.items():
        if (sensor.kind == "wheels") != (name == ODOM):
            yield MisfitError(
                f"position counters, and nothing else, are called `{ODOM}`; rename `{name}`",
                "sensors", name, KEY,
            )  # fmt: skip


def _misread(robot_type: RobotType, protocol: Asked) -> Iterator[MisfitError]:
    for name, sensor in robot_type.sensors.items():
        query = protocol.queries.get(sensor.read or name)
        if query is None:
            yield MisfitError(
                f"sensor `{name}` reads `{sensor.read or name}`, which is none of the `queries`; "
                f"add it there, or name one of {', '.join(protocol.queries) or 'none yet'} under `read`",
                "sensors", name, "read",
            )  # fmt: skip
        elif sensor.kind != "image" and sensor.first + sensor.count > query.values:
            yield MisfitError(
                f"the reply to `{sensor.read or name}` has {query.values} values, sensor `{name}` takes "
                f"{sensor.count} from number {sensor.first} on; mend `first`, or what the reply has",
                "sensors", name, "first",
            )  # fmt: skip
    used = {sensor.read or name for name, sensor in robot_type.sensors.items()}
    for idle in [name for name in protocol.queries if name not in used]:
        yield MisfitError(
            f"no sensor reads the query `{idle}`; add one to `sensors`, or take the query out",
            "protocol", "queries", idle, KEY,
        )  # fmt: skip


def _of_a_camera(robot_type: RobotType, protocol: Asked) -> Iterator[MisfitError]:
    cameras = {name: one for name, one in robot_type.sensors.items() if isinstance(one, Image)}
    for name in list(cameras)[1:]:
        yield MisfitError("a robot has one camera; take the others out", "sensors", name, KEY)
    if not cameras and robot_type.settings.camera != AS_BUILT:
        yield MisfitError("none of the `sensors` is of kind `image`", "settings", "camera", KEY)
    queries = protocol.queries if protocol.kind == "binary" else {}
    for name, image in cameras.items():
        if protocol.kind != "binary":
            yield MisfitError(
                "only a protocol of kind `binary` brings images; take it out", "sensors", name, "kind"
            )
        query = queries.get(image.read or name)
        if query is not None and not query.pixels:
            yield MisfitError(
                f"the reply to `{image.read or name}` is no image; write `{{pixels}}` at its end",
                "protocol", "queries", image.read or name, "reply",
            )  # fmt: skip
        elif query is not None and image.first != query.values:
            yield MisfitError(
                f"the pixels come after {query.values} numbers; write `first: {query.values}`",
                "sensors", name, "first",
            )  # fmt: skip
        for _, what, mend in tuned(image, robot_type.settings.camera).complaints():
            yield MisfitError(f"it cannot make such images: {what}; {mend}", "settings", "camera", KEY)
    read = {one.read or name for name, one in cameras.items()}
    for name in [one for one, query in queries.items() if query.pixels and one not in read]:
        yield MisfitError(
            f"no sensor of kind `image` reads `{name}`, whose reply has pixels; name it under `read` of one",
            "protocol", "queries", name, KEY,
        )  # fmt: skip


def _misset(robot_type: RobotType, protocol: Asked) -> Iterator[MisfitError]:
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
            yield MisfitError(wrong, "actuators", name, KEY if actuator.send is None else "send")


def _too_fast(robot_type: RobotType, protocol: Asked) -> Iterator[MisfitError]:
    kinematics = robot_type.kinematics
    if protocol.kind != "binary" or not kinematics.scales:
        return
    lowest, highest = room_of(protocol.set_speed.send, *SIDES)
    units = kinematics.wheel_speed_max * max(one.speed_units_per_mps for one in kinematics.scales)
    if round(units) > min(-lowest, highest):
        yield MisfitError(
            f"`wheel_speed_max` is {units:g} units of speed, and `set_speed` has room for {lowest:g} to "
            f"{highest:g}; write larger places, like {{left:i}}, or mend `scales`",
            "kinematics", "wheel_speed_max",
        )  # fmt: skip


def _of_a_sketch(robot_type: RobotType, sketch: RosserialProtocol) -> Iterator[MisfitError]:
    kinematics = robot_type.kinematics
    if kinematics.scales:
        yield MisfitError(
            "a sketch takes orders in m/s and rad/s; remove `kinematics.scales`",
            "kinematics", "scales", KEY,
        )  # fmt: skip
    if robot_type.sensors or robot_type.actuators:
        yield MisfitError(
            "what a sketch measures and hears stands under `protocol`; remove `sensors` and `actuators`",
            "sensors" if robot_type.sensors else "actuators", KEY,
        )  # fmt: skip
    if sketch.firmware:
        yield from _of_our_sketch(robot_type)
    if sketch.odometry and kinematics.wheel_radius is None:
        yield MisfitError(
            "`odometry` needs to know how large the wheels are: add `kinematics.wheel_radius`",
            "kinematics", KEY,
        )  # fmt: skip
    if not robot_type.firmware_dead_man:
        yield MisfitError(
            "nothing but the sketch stops a rosserial robot whose line breaks; build a dead-man into it,"
            " and write `firmware_dead_man: true`",
            "firmware_dead_man",
        )


def _of_our_sketch(robot_type: RobotType) -> Iterator[MisfitError]:
    if robot_type.kinematics.wheel_radius is None:
        yield MisfitError(
            "a sketch divides by the wheels' radius; add `kinematics.wheel_radius`", "kinematics", KEY
        )
    for key, (least, most) in SKETCH_BOUNDS.items():
        value = getattr(robot_type.kinematics, key)
        if value is not None and not least <= value <= most:
            yield MisfitError(
                f"swarmctl's sketch is made for a `{key}` of {least:g} to {most:g}", "kinematics", key
            )
    said = robot_type.settings.firmware
    for second, first, pin in clashes(said):
        at = second if getattr(getattr(said, second[0]), second[1]) is not None else first
        yield MisfitError(
            f"pin {pin} has two uses, `{'.'.join(first)}` and `{'.'.join(second)}`",
            "settings", "firmware", *at,
        )  # fmt: skip
