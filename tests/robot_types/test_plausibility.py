"""What makes no sense about a robot type is found; no robot of the field, and no shipped type, is doubted."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.plausibility import (
    Doubt,
    doubts_about_calibration,
    doubts_about_wheels,
    standstills,
    wrapping_counters,
)
from swarmctl.robot_types.plausible_sensors import doubts_about_sensors
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.spec.catalog import load_catalog
from tests.robot_types.field_robots import FIELD, FieldRobot, as_type

CATALOG = with_protocol(load_catalog().types)
BY_NAME = {one.name: one for one in FIELD}


def doubts(robot_type: RobotType, rate: float = 10.0) -> Iterator[Doubt]:
    """Everything that speaks against a type."""
    yield from doubts_about_wheels(robot_type)
    yield from standstills(robot_type, robot_type.settings)
    yield from doubts_about_sensors(robot_type)
    yield from doubts_about_calibration(robot_type, robot_type.settings)
    wrapping = wrapping_counters(robot_type, rate)
    if wrapping is not None:
        yield wrapping


def rules(data: dict[str, Any]) -> list[str]:
    return [one.rule for one in doubts(RobotType.model_validate(data))]


def changed(robot: str, **values: Any) -> dict[str, Any]:
    """A robot of the field with other values of `kinematics`."""
    data = as_type(BY_NAME[robot])
    scale = {key: values.pop(key) for key in ("speed_units_per_mps", "metres_per_count") if key in values}
    data["kinematics"] |= values
    data["kinematics"]["scales"][0] |= scale
    return data


def sensor(**values: Any) -> dict[str, Any]:
    """An e-puck whose distance sensor has other values."""
    data = copy.deepcopy(as_type(BY_NAME["e-puck"]))
    data["sensors"]["near"] |= values
    data["protocol"]["queries"]["near"]["values"] = len(data["sensors"]["near"]["elements"])
    return data


@pytest.mark.parametrize("name", sorted(CATALOG))
@pytest.mark.parametrize("rate", [1.0, 10.0, 50.0])
def test_no_shipped_type_is_doubted(name: str, rate: float) -> None:
    assert list(doubts(CATALOG[name], rate)) == []


@pytest.mark.parametrize("robot", FIELD, ids=lambda robot: robot.name)
def test_no_robot_of_the_field_is_doubted(robot: FieldRobot) -> None:
    assert rules(as_type(robot)) == []


@given(st.sampled_from(FIELD), st.floats(0.8, 1.25), st.floats(0.8, 1.25), st.floats(0.8, 1.25))
def test_no_robot_a_little_larger_or_faster_is_doubted(
    robot: FieldRobot, separation: float, radius: float, speed: float
) -> None:
    factors = {"wheel_separation": separation, "wheel_radius": radius, "wheel_speed_max": speed}
    assert rules(as_type(robot, **factors)) == []


def has(robot: FieldRobot, key: str) -> bool:
    needed = {"wheel_radius": robot.radius, "metres_per_count": robot.counts}
    return needed.get(key, True) is not None


def valid(robot: FieldRobot, key: str, factor: float) -> RobotType | None:
    """The type with one length in another unit; None where the format refuses it already."""
    try:
        return RobotType.model_validate(as_type(robot, **{key: factor}))
    except ValueError:
        return None


def reported(key: str, factor: float) -> float:
    """The share of the robots of the field for which a length in another unit is reported."""
    tried = [valid(one, key, factor) for one in FIELD if has(one, key)]
    return sum(one is None or any(doubts(one)) for one in tried) / len(tried)


# The share of the robots of the field, by factor. No check distinguishes a wheel from one with ten times as
# many counts, a slow robot from one ten times as fast, or a sensor in the middle from one at the edge.
SHARES = {
    "wheel_separation": {1000: 1.0, 100: 1.0, 10: 1.0, 0.1: 1.0, 0.01: 1.0, 0.001: 1.0},
    "wheel_radius": {1000: 1.0, 100: 1.0, 10: 1.0, 0.1: 1.0, 0.01: 1.0, 0.001: 1.0},
    "wheel_speed_max": {1000: 1.0, 100: 1.0, 10: 0.3, 0.01: 0.9, 0.001: 1.0},
    "metres_per_count": {1000: 0.6, 0.01: 0.3, 0.001: 0.8},
    "place": {1000: 1.0, 100: 1.0, 10: 0.9},
}


@pytest.mark.parametrize(
    ("key", "factor"), [(key, factor) for key, shares in SHARES.items() for factor in shares]
)
def test_a_length_in_another_unit_is_reported(key: str, factor: float) -> None:
    assert reported(key, factor) >= SHARES[key][factor]


def test_millimetres_in_a_metre_key_are_errors() -> None:
    """What the paper's Koala gets from a typing error: 28.5 for 0.285 m."""
    assert rules(changed("Koala", wheel_separation=28.5)) == ["SENSE001"]
    assert rules(changed("Koala", wheel_radius=4.25)) == ["SENSE001"]
    assert rules(changed("Koala", wheel_radius=0.425)) == ["SENSE002"]


def test_one_wrong_value_is_one_doubt() -> None:
    """The wheels' separation takes part in three quantities."""
    assert len(rules(changed("Khepera III", wheel_separation=88.41))) == 1


def test_a_full_speed_that_is_no_unit_never_moves() -> None:
    assert rules(changed("Koala", speed_units_per_mps=1.0)) == ["SENSE005"]
    assert rules(changed("Koala", speed_units_per_mps=12.0)) == ["SENSE006"]


def test_a_slowest_speed_near_the_fastest_is_doubted() -> None:
    assert rules(changed("Koala", wheel_speed_min=0.3)) == ["SENSE006"]
    assert rules(changed("Koala", wheel_speed_min=0.1)) == []


def test_a_limit_below_the_slowest_speed_never_moves() -> None:
    koala = RobotType.model_validate(changed("Koala", wheel_speed_min=0.1))
    settings = RobotSettings.model_validate({"limits": {"linear": 0.04}})
    (found,) = standstills(koala, settings)
    assert (found.rule, found.at) == ("SENSE005", ("settings", "limits", "linear"))


def test_counters_that_wrap_between_two_readings_are_errors() -> None:
    epuck = RobotType.model_validate(changed("e-puck", counter_bits=8))
    assert wrapping_counters(epuck, 50.0) is None
    nearly = wrapping_counters(epuck, 20.0)
    assert nearly is not None
    assert nearly.rule == "SENSE008"
    wrapped = wrapping_counters(epuck, 5.0)
    assert wrapped is not None
    assert wrapped.rule == "SENSE007"
    assert wrapped.help == "read `odom` at 7.9 Hz or more"
    assert wrapping_counters(epuck, 0.0) is None


def test_counts_and_units_that_no_wheel_has_are_doubted() -> None:
    assert rules(changed("Koala", metres_per_count=0.5)) == ["SENSE009"]
    assert rules(changed("Koala", metres_per_count=0.08)) == ["SENSE010"]
    assert rules(changed("Koala", metres_per_count=4.5e-9)) == ["SENSE009"]


@pytest.mark.parametrize(
    ("calibration", "found"),
    [
        ({"wheel_separation": 0.285, "distance_scale": 1.03}, []),
        ({"wheel_separation": 0.54}, []),  # wheels that skid
        ({"wheel_separation": 0.1}, ["SENSE004"]),
        ({"wheel_separation": 28.5}, ["SENSE003"]),
        ({"wheel_separation": 0.0285}, ["SENSE003"]),
        ({"distance_scale": 1.6}, ["SENSE004"]),
    ],
)
def test_a_calibration_far_from_the_type_is_doubted(calibration: dict[str, float], found: list[str]) -> None:
    settings = RobotSettings.model_validate({"calibration": calibration})
    assert [one.rule for one in doubts_about_calibration(CATALOG["koala"], settings)] == found


@pytest.mark.parametrize(
    ("place", "found"),
    [
        ({"x": 0.035, "y": 0.01}, []),
        ({"x": 0.35, "y": 0.01}, ["SENSE012"]),
        ({"x": 35.0, "y": 10.0}, ["SENSE011"]),
        ({"x": 0.03, "y": 0.0, "z": 34.0}, ["SENSE011"]),
        ({"x": 0.03, "y": 0.0, "z": 0.4}, []),  # on a mast
    ],
)
def test_a_sensor_outside_the_robot_is_doubted(place: dict[str, float], found: list[str]) -> None:
    assert rules(sensor(elements=[{"name": "front", "heading_deg": 0.0, **place}])) == found


def ring(*headings: float) -> list[dict[str, Any]]:
    """Sensors around an e-puck: ahead, left, back, right."""
    places = ((0.03, 0.0), (0.0, 0.03), (-0.03, 0.0), (0.0, -0.03))
    return [
        {"name": f"s{number}", "x": x, "y": y, "heading_deg": heading}
        for number, ((x, y), heading) in enumerate(zip(places, headings, strict=True))
    ]


@pytest.mark.parametrize(
    ("values", "found"),
    [
        ({"elements": ring(0.0, 90.0, 180.0, -90.0)}, []),
        ({"elements": ring(0.0, 1.571, 3.1416, -1.571)}, ["SENSE013"]),
        ({"elements": ring(0.0, 0.0, 0.0, 0.0)}, []),  # all look ahead
        ({"field_of_view_deg": 0.26}, ["SENSE013"]),
        ({"field_of_view_deg": 270.0}, ["SENSE013"]),
        ({"field_of_view_deg": 5.0}, []),
    ],
)
def test_radians_in_a_degree_key_are_doubted(values: dict[str, Any], found: list[str]) -> None:
    assert rules(sensor(**values)) == found


@pytest.mark.parametrize(
    ("values", "found"),
    [
        ({"distances": [[0, 50.0], [100, 2.0]]}, ["SENSE014"]),
        ({"distances": [[0, 0.005], [100, 0.001]]}, ["SENSE014"]),
        ({"distances": [[0, 0.1], [50, 0.3], [100, 0.05]]}, ["SENSE014"]),
        ({"max_reading": 50, "distances": [[60, 0.5], [100, 0.1]]}, ["SENSE014"]),
        ({"invalid_from": 1, "distances": [[10, 0.5], [100, 0.1]]}, ["SENSE014"]),
        ({"none_below": 101}, ["SENSE014"]),
        ({"none_below": 5, "distances": [[0, 0.5], [100, 0.1]]}, []),
    ],
)
def test_a_distance_table_without_sense_is_doubted(values: dict[str, Any], found: list[str]) -> None:
    assert rules(sensor(**values)) == found


@pytest.mark.parametrize(
    ("one", "found"),
    [
        ({"kind": "battery", "volts": [0.02], "empty": 3.4, "full": 4.2}, []),
        ({"kind": "battery", "volts": [0.02], "empty": 3400.0, "full": 4200.0}, ["SENSE015"]),
        ({"kind": "battery", "volts": [0.02], "empty": 3.4, "full": 42.0}, ["SENSE015"]),
        ({"kind": "magnetic", "axes": {"scale": [1.5e-7, 1.5e-7, 1.5e-7]}}, []),
        ({"kind": "magnetic", "axes": {"scale": [0.15, 0.15, 0.15]}}, ["SENSE015"]),
        ({"kind": "imu", "acceleration": {"scale": [0.006, 0.006, 0.006]}}, []),
        ({"kind": "imu", "acceleration": {"scale": [6.0, 6.0, 6.0]}}, ["SENSE015"]),
        ({"kind": "imu", "rotation": {"scale": [0.00122, 0.00122, 0.00122]}}, []),
    ],
)
def test_a_unit_without_sense_is_doubted(one: dict[str, Any], found: list[str]) -> None:
    data = as_type(BY_NAME["e-puck"])
    data["protocol"]["queries"]["one"] = {"send": "Q", "reply": "q", "values": 3}
    data["sensors"]["one"] = {"rate": 1.0, "read": "one", **one}
    assert rules(data) == found


def test_a_reply_too_small_for_the_battery_is_doubted() -> None:
    data = as_type(BY_NAME["e-puck"])
    queries = {
        "near": {"send": "01", "reply": "H"},
        "position": {"send": "02", "reply": "2h"},
        "one": {"send": "03", "reply": "B"},
    }
    data["protocol"] = {"kind": "binary", "set_speed": {"send": "04 {left:h} {right:h}"}, "queries": queries}
    battery = {"kind": "battery", "rate": 1.0, "read": "one", "volts": [0.02], "empty": 11.0, "full": 13.0}
    data["sensors"]["one"] = battery
    assert rules(data) == ["SENSE015"]
    data["protocol"]["queries"]["one"]["reply"] = "H"
    assert rules(data) == []
