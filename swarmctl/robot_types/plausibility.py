"""Whether a robot type makes sense: wheels, speed, encoders and counters against each other and physics.

What is usual includes every shipped type and the robots of `tests/robot_types/field_robots.py`, with a
margin on both sides; what is impossible contradicts physics or the size of any robot.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarmctl.robot_types.robot_type import RobotType

Place = tuple[str | int, ...]  # where in a type, or in a robot, a value stands
_COUNTER_BITS = {"std_msgs/Int16": 16, "std_msgs/Int32": 32}  # of the topics of a sketch
CHECK = "check its unit, and its decimal point"


@dataclass(frozen=True)
class Implausible:
    """What speaks against a value: the rule, a sentence, and where the value stands."""

    rule: str
    message: str
    at: Place
    label: str
    help: str = CHECK


@dataclass(frozen=True)
class _Range:
    """What is usual of a quantity, ``low`` to ``high``, and possible, ``least`` to ``most``."""

    unit: str
    least: float
    low: float
    high: float
    most: float


_RANGES: Mapping[str, _Range] = {
    # From Kilobot (33 mm across) and Zooids (26 mm) to Warthog (1.2 m) and farm machines (3 m).
    "separation": _Range(" m", 0.003, 0.01, 3, 12),
    # From wheels of a Zooid (3 mm) to those of a tractor (0.8 m).
    "radius": _Range(" m", 0.001, 0.002, 0.8, 2),
    # Tracks by radius: e-puck 2.6, Husky 3.5, Koala 6.8, TurtleBot3 Waffle 8.7. Below 0.5 a robot is
    # four times as high as wide; one of the ratio 60 has wheels like coins under a table.
    "proportion": _Range("", 0.5, 1.2, 20, 60),
    # From Kilobot (0.01 m/s) to Warthog (5 m/s); above 30 m/s it is a racing car.
    "speed": _Range(" m/s", 0.0005, 0.003, 10, 30),
    # Turning on the spot at full speed: Kilobot 0.8, TurtleBot3 2.8, Jackal 10.6, Khepera IV 15. Two
    # turns a second are 12; above 250 (40 turns a second) tyres do not hold.
    "turning": _Range(" rad/s", 0.01, 0.1, 60, 250),
    # Counts of one turn of a wheel: rover 20, Duckiebot 135, Create 509, e-puck 1000, Husky 80 000.
    "counts per turn": _Range("", 1, 6, 300_000, 20_000_000),
    # Counts of a second at full speed: rover 49, e-puck 1000, Pioneer 3-DX 150 000.
    "counts per second": _Range(" 1/s", 1, 10, 2_000_000, 100_000_000),
}


@dataclass(frozen=True)
class _Quantity:
    """A quantity that follows from a type: its name in ``_RANGES``, its sentence, and the key to look at."""

    name: str
    value: float
    message: str
    at: Place
    help: str = CHECK

    def doubt(self, impossible: str, unusual: str) -> Implausible | None:
        """Returns the doubt about it, under one of two rules, if there is one."""
        range_ = _RANGES[self.name]
        if range_.low <= self.value <= range_.high:
            return None
        rule = unusual if range_.least <= self.value <= range_.most else impossible
        usual = f"usual: {range_.low:g} to {range_.high:g}{range_.unit}"
        return Implausible(rule, self.message, self.at, usual, self.help)


def implausible_wheels(robot_type: RobotType) -> Implausible | None:
    """Returns what makes no sense about wheels, speed and encoders; a cause hides what follows from it."""
    groups = (
        (_size(robot_type), "SENSE001", "SENSE002"),
        (_motion(robot_type), "SENSE001", "SENSE002"),
        (_encoders(robot_type), "SENSE009", "SENSE010"),
    )
    for quantities, impossible, unusual in groups:
        found = [doubt for one in quantities if (doubt := one.doubt(impossible, unusual))]
        if found:
            return next((one for one in found if one.rule == impossible), found[0])
    return None


def _size(robot_type: RobotType) -> Iterator[_Quantity]:
    separation, radius = robot_type.kinematics.wheel_separation, robot_type.kinematics.wheel_radius
    at, proportion = ("kinematics", "wheel_separation"), _RANGES["proportion"]
    beside = (proportion.low * radius, proportion.high * radius) if radius else ()
    help_ = _meant_beside("separation", separation, beside)
    yield _Quantity("separation", separation, f"the wheels are {separation:g} m apart", at, help_)
    if radius is not None:
        beside = (separation / proportion.high, separation / proportion.low)
        message = f"the wheels have a radius of {radius:g} m"
        of_radius = _meant_beside("radius", radius, beside)
        yield _Quantity("radius", radius, message, ("kinematics", "wheel_radius"), of_radius)
        ratio = separation / radius
        message = f"wheels with a radius of {radius:g} m are {separation:g} m apart: {rounded(ratio)} radii"
        yield _Quantity("proportion", ratio, message, at, help_)


def _meant_beside(name: str, metres: float, beside: tuple[float, ...]) -> str:
    """Returns the advice for a length: the unit that fits the other length, else any that is sensible."""
    fitting = meant(metres, *beside) if beside else CHECK
    return fitting if fitting != CHECK else meant(metres, _RANGES[name].low, _RANGES[name].high)


def meant(metres: float, low: float, high: float) -> str:
    """Returns the advice for a length: the number in the unit in which it is from ``low`` to ``high``."""
    for unit, size in (("cm", 0.01), ("mm", 0.001)):
        if low <= metres * size <= high:
            return f"did you mean `{metres:g} {unit}`?"
    return CHECK


def rounded(value: float) -> str:
    """Returns a number with three digits; thousands have all digits before the point."""
    return f"{value:.0f}" if 999.5 <= value < 1e7 else f"{value:.3g}"


def _motion(robot_type: RobotType) -> Iterator[_Quantity]:
    speed, separation = robot_type.kinematics.wheel_speed_max, robot_type.kinematics.wheel_separation
    at = ("kinematics", "wheel_speed_max")
    yield _Quantity("speed", speed, f"the wheels go {speed:g} m/s", at)
    turning = 2 * speed / separation
    message = f"at {speed:g} m/s, with wheels {separation:g} m apart, it turns at {rounded(turning)} rad/s"
    yield _Quantity("turning", turning, message, at)


def _encoders(robot_type: RobotType) -> Iterator[_Quantity]:
    """Counts of an encoder, by the turn of a wheel and by the second at full speed."""
    speed, radius = robot_type.kinematics.wheel_speed_max, robot_type.kinematics.wheel_radius
    for metres, at in _metres_per_count(robot_type):
        if radius is not None:
            counts = 2 * math.pi * radius / metres
            message = f"a turn of a wheel is {counts:.4g} counts: {metres:.4g} m each"
            yield _Quantity("counts per turn", counts, message, at)
        message = f"at {speed:g} m/s a wheel counts {speed / metres:.4g} times in a second"
        yield _Quantity("counts per second", speed / metres, message, at)


def _metres_per_count(robot_type: RobotType) -> Iterator[tuple[float, Place]]:
    kinematics, sketch = robot_type.kinematics, robot_type.sketch
    if sketch is not None and sketch.odometry is not None and kinematics.wheel_radius is not None:
        turn = 2 * math.pi * kinematics.wheel_radius
        yield turn / sketch.odometry.counts_per_turn, ("protocol", "odometry", "counts_per_turn")
    if any(one.kind == "wheels" for one in robot_type.sensors.values()):
        for index, scale in enumerate(kinematics.scales):
            yield scale.metres_per_count, ("kinematics", "scales", index, "metres_per_count")


def implausible_separation(measured: float, of_type: float) -> Implausible | None:
    """Returns the doubt about a wheel separation that was measured on a robot.

    Husky's controller takes 1.875 times its own for wheels that skid, the Koalas take 0.86 to 1.03.
    """
    ratio = measured / of_type
    if 0.25 <= ratio <= 4:
        return None
    message = f"a `wheel_separation` of {measured:g} m is {rounded(ratio)} times its type's {of_type:g} m"
    at = ("settings", "calibration", "wheel_separation")
    return Implausible("SENSE003", message, at, "usual: 0.5 to 2", meant(measured, of_type / 2, of_type * 2))


def standstill(robot_type: RobotType, limit: float | None) -> Implausible | None:
    """Returns the doubt about a full speed, or a limit (m/s), at which every command is rounded to zero."""
    kinematics = robot_type.kinematics
    speed = min(kinematics.wheel_speed_max, limit or math.inf)
    of_limit = speed < kinematics.wheel_speed_max
    at: Place = ("settings", "limits", "linear")
    for index, scale in enumerate(kinematics.scales):
        if speed * scale.speed_units_per_mps < 0.5:
            message = f"its full speed of {speed:g} m/s is rounded to 0 units of speed: it never moves"
            at = at if of_limit else ("kinematics", "scales", index, "speed_units_per_mps")
            step = f"a unit of speed is {rounded(1 / scale.speed_units_per_mps)} m/s"
            help_ = "raise the limit" if of_limit else "check `speed_units_per_mps`, and `wheel_speed_max`"
            return Implausible("SENSE005", message, at, step, help_)
    slowest = kinematics.wheel_speed_min
    if speed < slowest / 2:
        at = at if of_limit else ("kinematics", "wheel_speed_min")
        half = f"half of its slowest, {slowest:g} m/s"
        message = f"its full speed of {speed:g} m/s is below {half}: it never moves"
        return Implausible("SENSE005", message, at, "slower commands are zero", "raise the limit")
    return None


def wrapping_counters(robot_type: RobotType, rate: float) -> Implausible | None:
    """Returns the doubt that counters wrap between two readings, of which ``rate`` are in a second."""
    counted = _counters(robot_type)
    if counted is None or rate <= 0:
        return None
    bits, per_second, at = counted
    between, half = per_second / rate, 2.0 ** (bits - 1)
    if between < half:
        return None
    least = math.ceil(per_second / half * 10) / 10
    help_ = f"read `odom` at {least:g} Hz or more" if least <= 50 else "check `counter_bits` and the scales"
    message = (
        f"between two readings at {rate:g} Hz a wheel counts {between:.0f}, half a turn of its {bits}-bit"
        " counter or more: forward looks like backward"
    )
    return Implausible("SENSE007", message, at, f"unclear from {half:g} on", help_)


def _counters(robot_type: RobotType) -> tuple[int, float, Place] | None:
    """Bits of a position counter, its counts in a second at full speed, and where its width stands."""
    kinematics, sketch = robot_type.kinematics, robot_type.sketch
    if sketch is None:
        finest = min((one.metres_per_count for one in kinematics.scales), default=math.inf)
        at = ("kinematics", "counter_bits" if "counter_bits" in kinematics.model_fields_set else "scales")
        return kinematics.counter_bits, kinematics.wheel_speed_max / finest, at
    if sketch.odometry is None or kinematics.wheel_radius is None:
        return None
    index = next(index for index, one in enumerate(sketch.publishes) if one.topic == sketch.odometry.left)
    turns = kinematics.wheel_speed_max / (2 * math.pi * kinematics.wheel_radius)
    bits = _COUNTER_BITS[sketch.publishes[index].type]
    return bits, turns * sketch.odometry.counts_per_turn, ("protocol", "publishes", index, "type")
