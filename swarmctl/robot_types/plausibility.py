"""Whether a robot type makes sense: its wheels, speeds, units and counters against each other and physics."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.robot_types.kinematics import Kinematics, Scale
from swarmctl.robot_types.protocols import RosserialProtocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.sensible_ranges import LOST_REPLIES, RANGES, Sensible
from swarmctl.robot_types.settings import RobotSettings

COUNTER_BITS = {"std_msgs/Int16": 16, "std_msgs/Int32": 32}  # of the topics of a sketch
CHECK = "check its unit, and its decimal point"


@dataclass(frozen=True)
class Doubt:
    """What speaks against a value: the rule, a sentence, and where in the type or the settings it stands."""

    rule: str
    message: str
    at: tuple[str | int, ...]
    label: str = ""
    help: str = CHECK


@dataclass(frozen=True)
class _Quantity:
    """A quantity that follows from a type: its name in ``RANGES``, its sentence, and the key to look at."""

    range: str
    value: float
    message: str
    at: tuple[str | int, ...]
    help: str = CHECK

    @property
    def sensible(self) -> Sensible:
        return RANGES[self.range]

    def doubt(self, impossible: str, unusual: str) -> Doubt | None:
        """Returns the doubt about it, under one of two rules, if there is one."""
        if not self.sensible.unusual(self.value):
            return None
        rule = impossible if self.sensible.impossible(self.value) else unusual
        return Doubt(rule, self.message, self.at, f"usual: {self.sensible.usual}", self.help)


def doubts_about_wheels(robot_type: RobotType) -> Iterator[Doubt]:
    """Yields what makes no sense about wheels, speeds and counters; a cause hides what follows from it."""
    groups = (
        (_size(robot_type.kinematics), "SENSE001", "SENSE002"),
        (_motion(robot_type.kinematics), "SENSE001", "SENSE002"),
        (_units(robot_type), "SENSE009", "SENSE010"),
    )
    for quantities, impossible, unusual in groups:
        found = [doubt for one in quantities if (doubt := one.doubt(impossible, unusual))]
        if found:
            yield next((one for one in found if one.rule == impossible), found[0])
            return


def _size(kinematics: Kinematics) -> Iterator[_Quantity]:
    separation, radius = kinematics.wheel_separation, kinematics.wheel_radius
    at = ("kinematics", "wheel_separation")
    proportion = RANGES["proportion"]
    by_radius = (proportion.low * radius, proportion.high * radius) if radius else ()
    help_ = _meant_beside("separation", separation, by_radius)
    yield _Quantity("separation", separation, f"the wheels are {separation:g} m apart", at, help_)
    if radius is not None:
        message = f"the wheels have a radius of {radius:g} m"
        by_separation = (separation / proportion.high, separation / proportion.low)
        of_radius = _meant_beside("radius", radius, by_separation)
        yield _Quantity("radius", radius, message, ("kinematics", "wheel_radius"), of_radius)
        ratio = separation / radius
        message = f"wheels with a radius of {radius:g} m are {separation:g} m apart: {rounded(ratio)} radii"
        yield _Quantity("proportion", ratio, message, at, help_)


def _meant_beside(range_: str, metres: float, beside: tuple[float, ...]) -> str:
    """Returns the advice for a length: the unit that fits the other length, else any that is sensible."""
    sensible = RANGES[range_]
    fitting = meant(metres, *beside) if beside else CHECK
    return fitting if fitting != CHECK else meant(metres, sensible.low, sensible.high)


def meant(metres: float, low: float, high: float) -> str:
    """Returns the advice for a length: the number in the unit in which it is from ``low`` to ``high``."""
    for unit, size in (("cm", 0.01), ("mm", 0.001)):
        if low <= metres * size <= high:
            return f"did you mean `{metres:g} {unit}`?"
    return CHECK


def rounded(value: float) -> str:
    """Returns a number with three digits; thousands have all digits before the point."""
    return f"{value:.0f}" if 999.5 <= value < 1e7 else f"{value:.3g}"


def _motion(kinematics: Kinematics) -> Iterator[_Quantity]:
    speed, at = kinematics.wheel_speed_max, ("kinematics", "wheel_speed_max")
    yield _Quantity("speed", speed, f"the wheels go {speed:g} m/s", at)
    if kinematics.wheel_radius is not None:
        turns = speed / (2 * math.pi * kinematics.wheel_radius)
        yield _Quantity(
            "revolutions", turns, f"at {speed:g} m/s a wheel makes {rounded(turns)} turns in a second", at
        )
    separation = kinematics.wheel_separation
    turning = 2 * speed / separation
    message = f"at {speed:g} m/s, with wheels {separation:g} m apart, it turns at {rounded(turning)} rad/s"
    yield _Quantity("turning", turning, message, at)


def _units(robot_type: RobotType) -> Iterator[_Quantity]:
    """How counters and units of speed fit the wheels and the full speed."""
    kinematics = robot_type.kinematics
    speed, radius = kinematics.wheel_speed_max, kinematics.wheel_radius
    counting = any(one.kind == "wheels" for one in robot_type.sensors.values())
    for index, scale in enumerate(kinematics.scales):
        at = ("kinematics", "scales", index)
        if radius is not None and counting:
            counts = 2 * math.pi * radius / scale.metres_per_count
            message = f"a turn of a wheel is {counts:.4g} counts: {scale.metres_per_count:g} m each"
            yield _Quantity("counts per turn", counts, message, (*at, "metres_per_count"))
        if counting:
            rate = speed / scale.metres_per_count
            message = f"at {speed:g} m/s a wheel counts {rate:.4g} times in a second"
            yield _Quantity("counts per second", rate, message, (*at, "metres_per_count"))
        yield _speed_units(speed, scale, at)
        if counting and speed * scale.speed_units_per_mps >= RANGES["speed units"].low:
            ratio = scale.speed_units_per_mps * scale.metres_per_count
            message = f"one count in a second is {rounded(ratio)} units of speed"
            yield _Quantity("unit of counts", ratio, message, (*at, "speed_units_per_mps"))
    sketch = robot_type.sketch
    if sketch is not None and sketch.odometry is not None and radius is not None:
        counts = sketch.odometry.counts_per_turn
        place = ("protocol", "odometry", "counts_per_turn")
        yield _Quantity("counts per turn", counts, f"a turn of a wheel is {counts:g} counts", place)
        rate = speed * counts / (2 * math.pi * radius)
        message = f"at {speed:g} m/s a wheel counts {rate:.4g} times in a second"
        yield _Quantity("counts per second", rate, message, place)


def _speed_units(speed: float, scale: Scale, at: tuple[str | int, ...]) -> _Quantity:
    """Full speed in units; the ones that are too few are the subject of `standstills`."""
    units = max(speed * scale.speed_units_per_mps, RANGES["speed units"].low)
    message = f"full speed, {speed:g} m/s, is {rounded(units)} units of speed"
    return _Quantity("speed units", units, message, (*at, "speed_units_per_mps"))


def standstills(robot_type: RobotType, settings: RobotSettings) -> Iterator[Doubt]:
    """Yields a full speed that is no unit, or only a few, and a slowest speed that leaves no choice."""
    kinematics, limit = robot_type.kinematics, settings.limits.linear
    speed = min(kinematics.wheel_speed_max, limit or math.inf)
    of_limit = limit is not None and limit < kinematics.wheel_speed_max
    at: tuple[str | int, ...] = ("settings", "limits", "linear")
    sensible = RANGES["speed units"]
    for index, scale in enumerate(kinematics.scales):
        units = speed * scale.speed_units_per_mps
        place = at if of_limit else ("kinematics", "scales", index, "speed_units_per_mps")
        step = f"a unit of speed is {rounded(1 / scale.speed_units_per_mps)} m/s"
        help_ = "raise the limit" if of_limit else "check `speed_units_per_mps`, and `wheel_speed_max`"
        if units < sensible.least:
            message = f"its full speed of {speed:g} m/s is rounded to 0 units of speed: it never moves"
            yield Doubt("SENSE005", message, place, step, help_)
            return
        if units < sensible.low:
            message = f"its full speed of {speed:g} m/s is {units:.2g} units of speed: it has few speeds"
            yield Doubt("SENSE006", message, place, step, help_)
            return
    slowest = kinematics.wheel_speed_min
    place = at if of_limit else ("kinematics", "wheel_speed_min")
    if speed < slowest / 2:
        message = (
            f"its full speed of {speed:g} m/s is below half of its slowest, {slowest:g} m/s: it never moves"
        )
        yield Doubt("SENSE005", message, place, "slower commands are zero", "raise the limit")
    elif slowest > speed / 2:
        message = f"its slowest speed, {slowest:g} m/s, is more than half of its full speed, {speed:g} m/s"
        yield Doubt("SENSE006", message, place, "slower commands become this or zero")


def wrapping_counters(robot_type: RobotType, rate: float, stretch: float = 1.0) -> Doubt | None:
    """Returns the doubt that position counters wrap between two readings, of which ``rate`` are in a second.

    ``stretch`` is the `distance_scale` of the robot, which leaves full speed in counts as it is.
    """
    counted = _counters(robot_type)
    if counted is None or rate <= 0:
        return None
    bits, per_second, at = counted
    between, half = per_second / rate, 2.0 ** (bits - 1)
    lost = LOST_REPLIES if robot_type.driver_protocol is not None else 1
    if between * lost < half:
        return None

    def faster(times: int) -> str:
        least = math.ceil(times * per_second / half * 10) / 10
        return (
            f"read `odom` at {least:g} Hz or more" if least <= 50 else "check `counter_bits` and the scales"
        )

    if between >= half:
        message = (
            f"between two readings at {rate:g} Hz a wheel counts {between:.0f}, half a turn of its {bits}-bit"
            " counter or more: forward looks like backward"
        )
        return Doubt("SENSE007", message, at, f"unclear from {half:g} on", faster(1))
    message = (
        f"after {lost - 1} lost replies at {rate:g} Hz a wheel may have counted {between * lost:.0f}, half a"
        f" turn of its {bits}-bit counter or more"
    )
    return Doubt("SENSE008", message, at, f"unclear from {half:g} on", faster(lost))


def _counters(robot_type: RobotType) -> tuple[int, float, tuple[str | int, ...]] | None:
    """Bits of a position counter, its counts in a second at full speed, and where its width stands."""
    kinematics, sketch = robot_type.kinematics, robot_type.sketch
    if sketch is not None:
        return _counters_of_sketch(kinematics, sketch)
    finest = min((one.metres_per_count for one in kinematics.scales), default=math.inf)
    at = ("kinematics", "counter_bits" if "counter_bits" in kinematics.model_fields_set else "scales")
    return kinematics.counter_bits, kinematics.wheel_speed_max / finest, at


def _counters_of_sketch(
    kinematics: Kinematics, sketch: RosserialProtocol
) -> tuple[int, float, tuple[str | int, ...]] | None:
    if sketch.odometry is None or kinematics.wheel_radius is None:
        return None
    index, topic = next(
        (index, one) for index, one in enumerate(sketch.publishes) if one.topic == sketch.odometry.left
    )
    per_metre = sketch.odometry.counts_per_turn / (2 * math.pi * kinematics.wheel_radius)
    return (
        COUNTER_BITS[topic.type],
        kinematics.wheel_speed_max * per_metre,
        ("protocol", "publishes", index, "type"),
    )


def doubts_about_calibration(robot_type: RobotType, settings: RobotSettings) -> Iterator[Doubt]:
    """Yields measured values that are far from those of the type."""
    measured, of_type = settings.calibration.wheel_separation, robot_type.kinematics.wheel_separation
    if measured is not None:
        ratio = measured / of_type
        message = f"a `wheel_separation` of {measured:g} m is {rounded(ratio)} times its type's {of_type:g} m"
        at = ("settings", "calibration", "wheel_separation")
        help_ = meant(measured, of_type / 2, of_type * 2)
        found = _Quantity("separation by type", ratio, message, at, help_).doubt("SENSE003", "SENSE004")
        if found:
            yield found
    stretch = settings.calibration.distance_scale
    if stretch is not None:
        message = (
            f"with a `distance_scale` of {stretch:g} its wheels are {stretch:g} times as large as its type's"
        )
        at = ("settings", "calibration", "distance_scale")
        found = _Quantity("distance scale", stretch, message, at).doubt("SENSE003", "SENSE004")
        if found:
            yield found
