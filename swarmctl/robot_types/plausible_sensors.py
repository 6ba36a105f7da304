"""Whether the sensors of a robot type make sense: places, angles, distances, what a unit stands for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from swarmctl.robot_types.binary_protocol import BinaryQuery, bounds_of
from swarmctl.robot_types.plausibility import Doubt, meant
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.sensible_ranges import LARGEST_SWING, NARROWEST_CONE, RANGES, WIDEST_CONE
from swarmctl.robot_types.sensors import Axes, Battery, Inertial, Magnetic, Place, Range

_COMMON_ANGLE = math.radians(15)  # headings of robots are multiples of it
_FEW = 3  # sensors that point nowhere else prove nothing


def doubts_about_sensors(robot_type: RobotType) -> Iterator[Doubt]:
    """Yields what makes no sense about the sensors of a type."""
    kinematics = robot_type.kinematics
    size = max(kinematics.wheel_separation, 4 * (kinematics.wheel_radius or 0))
    for name, sensor in robot_type.sensors.items():
        at = ("sensors", name)
        if isinstance(sensor, Range):
            yield from _places(sensor.elements, size, at)
            yield from _angles(sensor, at)
            yield from _distances(sensor, at)
        elif isinstance(sensor, Battery):
            yield from _battery(robot_type, name, sensor)
        elif isinstance(sensor, Inertial):
            for key, quantity in (("acceleration", sensor.acceleration), ("rotation", sensor.rotation)):
                if quantity is not None:
                    yield from _axes(key, quantity, (*at, key))
        elif isinstance(sensor, Magnetic):
            yield from _axes("magnetic", sensor.axes, (*at, "axes"))


def _places(elements: Sequence[Place], size: float, at: tuple[str | int, ...]) -> Iterator[Doubt]:
    """The sensor that is farthest from a robot of this size; the others are wrong with it."""
    far: list[tuple[float, int, str, float]] = []
    for index, one in enumerate(elements):
        for key, away in (("place", math.hypot(one.x, one.y)), ("height", abs(one.z))):
            if RANGES[key].unusual(away / size):
                far.append((away / size / RANGES[key].high, index, key, away))
    if not far:
        return
    _, index, key, away = max(far)
    one = elements[index]
    impossible = RANGES[key].impossible(away / size)
    where = "from the robot's centre" if key == "place" else "above or below its wheels' axis"
    coordinate = "z" if key == "height" else "x" if abs(one.x) >= abs(one.y) else "y"
    more = sum(1 for other in {each[1] for each in far}) - 1
    yield Doubt(
        "SENSE011" if impossible else "SENSE012",
        f"the sensor `{one.name}` is {away:g} m {where}, and its wheels are within {size:g} m",
        (*at, "elements", index, coordinate),
        f"and {more} more sensors" if more else "",
        meant(getattr(one, coordinate), 0.02 * size, size),
    )


def _angles(sensor: Range, at: tuple[str | int, ...]) -> Iterator[Doubt]:
    help_ = "write degrees, or the unit with the number, like 0.26 rad"
    if not NARROWEST_CONE <= sensor.field_of_view_deg <= WIDEST_CONE:
        wide = sensor.field_of_view_deg > WIDEST_CONE
        message = f"a distance sensor with a cone of {sensor.field_of_view_deg:g} degrees"
        more = (
            " looks behind itself"
            if wide
            else f": in radians these are {math.degrees(sensor.field_of_view_deg):.3g}"
        )
        yield Doubt("SENSE013", message + more, (*at, "field_of_view_deg"), "usual: 2 to 60 degrees", help_)
    if _in_radians(sensor.elements):
        at = (*at, "elements", 0, "heading_deg")
        message = "all headings are within 3.15 degrees of ahead, and as radians they point outwards"
        yield Doubt("SENSE013", message, at, "usual: sensors look away from the robot's centre", help_)
    elif (crossed := _first_crossed(sensor.elements)) is not None:
        one, at = sensor.elements[crossed], (*at, "elements", crossed, "heading_deg")
        message = (
            f"the sensor `{one.name}` sits on the {_side(one.y)} and looks to the {_side(one.heading_deg)}"
        )
        label = "all beside the axis look across the robot"
        yield Doubt("SENSE016", message, at, label, "headings count to the left: change the sign of each")


def _in_radians(elements: Sequence[Place]) -> bool:
    """True if headings fit their sensors' places as radians, and do not as degrees.

    A place shows a direction: sensors look away from the centre, more or less.
    """
    around = [one for one in elements if abs(math.atan2(one.y, one.x)) > math.radians(20)]
    few = len(around) < _FEW and not (around and all(_is_common_in_radians(one) for one in around))
    if few or any(abs(one.heading_deg) > math.pi + 0.01 for one in elements):
        return False
    as_radians = sum(_apart(math.atan2(one.y, one.x), one.heading_deg) for one in around)
    as_degrees = sum(_apart(math.atan2(one.y, one.x), math.radians(one.heading_deg)) for one in around)
    return as_radians < as_degrees / 2


def _is_common_in_radians(one: Place) -> bool:
    """True for a fraction of a degree that is, as radians, one of the usual headings, as 0.785 is."""
    steps = one.heading_deg / _COMMON_ANGLE
    is_whole = one.heading_deg.is_integer()
    return not is_whole and round(steps) != 0 and abs(steps - round(steps)) * _COMMON_ANGLE < 0.002


def _first_crossed(elements: Sequence[Place]) -> int | None:
    """The first sensor beside the axis if all of them, on both sides, look across the robot's front."""
    beside = [index for index, one in enumerate(elements) if one.y and 5 <= abs(one.heading_deg) < 90]
    sides = {elements[index].y > 0 for index in beside}
    crossed = all(elements[index].y * elements[index].heading_deg < 0 for index in beside)
    return beside[0] if len(sides) == 2 and crossed else None


def _side(value: float) -> str:
    return "left" if value > 0 else "right"


def _apart(first: float, second: float) -> float:
    return abs(math.remainder(first - second, math.tau))


def _distances(sensor: Range, at: tuple[str | int, ...]) -> Iterator[Doubt]:
    table = sensor.distances
    farthest, sensible = max(distance for _, distance in table), RANGES["range"]
    if sensible.unusual(farthest):
        message = f"it measures up to {farthest:g} m"
        help_ = "write metres, or another unit with the number, like 25 cm"
        yield Doubt("SENSE014", message, (*at, "distances"), f"usual: {sensible.usual}", help_)
    steps = [after[1] - before[1] for before, after in pairwise(table)]
    if any(step > 0 for step in steps) and any(step < 0 for step in steps):
        message = "its distances rise and fall with the reading: one distance has several readings"
        yield Doubt("SENSE014", message, (*at, "distances"), "usual: one direction", "check the pairs")
    if table[-1][0] > sensor.max_reading:
        message = (
            f"its table goes up to a reading of {table[-1][0]:g}, above `max_reading`, {sensor.max_reading}"
        )
        yield Doubt("SENSE014", message, (*at, "distances"), "never read", "check `max_reading`")
    for key in ("none_from", "invalid_from"):
        least = getattr(sensor, key)
        if least is not None and least <= table[0][0]:
            message = f"`{key}: {least}` leaves no reading of its table"
            yield Doubt("SENSE014", message, (*at, key), "never a distance", "raise it, or correct the table")
    if sensor.none_below is not None and sensor.none_below > table[-1][0]:
        message = f"`none_below: {sensor.none_below}` leaves no reading of its table"
        yield Doubt(
            "SENSE014", message, (*at, "none_below"), "never a distance", "lower it, or correct the table"
        )


def _battery(robot_type: RobotType, name: str, sensor: Battery) -> Iterator[Doubt]:
    at, sensible = ("sensors", name), RANGES["voltage"]
    if sensible.unusual(sensor.full):
        message = f"the battery has {sensor.full:g} V when full"
        help_ = "write volts, or another unit with the number, like 4200 mV"
        yield Doubt("SENSE015", message, (*at, "full"), f"usual: {sensible.usual}", help_)
    elif sensor.full / sensor.empty > LARGEST_SWING:
        message = f"the battery is empty at {sensor.empty:g} V and full at {sensor.full:g} V"
        yield Doubt("SENSE015", message, (*at, "empty"), "usual: empty at two thirds of full")
    elif (most := _most_volts(robot_type, name, sensor)) < sensor.empty:
        message = f"the reply holds {most:.3g} V at most, and the battery is empty at {sensor.empty:g} V"
        yield Doubt("SENSE015", message, (*at, "volts"), "always empty")


def _most_volts(robot_type: RobotType, name: str, sensor: Battery) -> float:
    """The largest voltage that a reply in bytes can hold; infinite for other replies."""
    protocol = robot_type.driver_protocol
    query = protocol.queries.get(sensor.read or name) if protocol is not None else None
    if not isinstance(query, BinaryQuery):
        return math.inf
    codes = query.codes[sensor.first : sensor.first + sensor.count]
    return sensor.offset + sum(
        volts * bounds_of(code)[1] for volts, code in zip(sensor.volts, codes, strict=True)
    )


def _axes(key: str, axes: Axes, at: tuple[str | int, ...]) -> Iterator[Doubt]:
    sensible = RANGES[f"{key} unit"]
    for index, scale in enumerate(axes.scale):
        if sensible.unusual(abs(scale)):
            message = f"one unit of the sensor is {abs(scale):g} {sensible.unit}"
            help_ = (
                f"write the scale in {sensible.unit}: data sheets have g, degrees in a second, and microtesla"
            )
            yield Doubt("SENSE015", message, (*at, "scale", index), f"usual: {sensible.usual}", help_)
            return
