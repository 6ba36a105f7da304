"""What makes no sense about a robot type is found; no robot of the field, and no shipped type, is doubted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.plausibility import (
    Implausible,
    implausible_separation,
    implausible_wheels,
    standstill,
    wrapping_counters,
)
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.catalog import load_catalog
from tests.robot_types.field_robots import FIELD, FieldRobot, as_type

CATALOG = with_protocol(load_catalog().types)
BY_NAME = {one.name: one for one in FIELD}


def doubts(robot_type: RobotType, rate: float = 10.0) -> Iterator[Implausible]:
    """Everything that speaks against a type."""
    found = (
        implausible_wheels(robot_type),
        standstill(robot_type, robot_type.settings.limits.linear),
        wrapping_counters(robot_type, rate),
    )
    yield from (one for one in found if one is not None)


def rules(data: dict[str, Any]) -> list[str]:
    return [one.rule for one in doubts(RobotType.model_validate(data))]


def changed(robot: str, **values: Any) -> dict[str, Any]:
    """A robot of the field with other values of `kinematics`."""
    data = as_type(BY_NAME[robot])
    scale = {key: values.pop(key) for key in ("speed_units_per_mps", "metres_per_count") if key in values}
    data["kinematics"] |= values
    data["kinematics"]["scales"][0] |= scale
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
# many counts, or a slow robot from one ten times as fast.
SHARES = {
    "wheel_separation": {1000: 1.0, 100: 1.0, 10: 1.0, 0.1: 1.0, 0.01: 1.0, 0.001: 1.0},
    "wheel_radius": {1000: 1.0, 100: 1.0, 10: 1.0, 0.1: 1.0, 0.01: 1.0, 0.001: 1.0},
    "wheel_speed_max": {1000: 1.0, 100: 1.0, 10: 0.3, 0.01: 0.85, 0.001: 1.0},
    "metres_per_count": {1000: 0.6, 0.01: 0.3, 0.001: 0.8},
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
    assert rules(changed("Koala", speed_units_per_mps=12.0)) == []


def test_a_limit_below_the_slowest_speed_never_moves() -> None:
    koala = RobotType.model_validate(changed("Koala", wheel_speed_min=0.1))
    found = standstill(koala, 0.04)
    assert found is not None
    assert (found.rule, found.at) == ("SENSE005", ("settings", "limits", "linear"))
    assert standstill(koala, 0.06) is None


def test_counters_that_wrap_between_two_readings_are_errors() -> None:
    epuck = RobotType.model_validate(changed("e-puck", counter_bits=8))
    assert wrapping_counters(epuck, 50.0) is None
    assert wrapping_counters(epuck, 20.0) is None
    wrapped = wrapping_counters(epuck, 5.0)
    assert wrapped is not None
    assert wrapped.rule == "SENSE007"
    assert wrapped.help == "read `odom` at 7.9 Hz or more"
    assert wrapping_counters(epuck, 0.0) is None


def test_counts_and_units_that_no_wheel_has_are_doubted() -> None:
    assert rules(changed("Koala", metres_per_count=0.5)) == ["SENSE009"]
    assert rules(changed("Koala", metres_per_count=0.08)) == ["SENSE010"]
    assert rules(changed("Koala", metres_per_count=4.5e-9)) == ["SENSE009"]


@pytest.mark.parametrize("measured", [0.285, 0.54])  # wheels that skid
def test_a_separation_near_that_of_the_type_is_possible(measured: float) -> None:
    assert implausible_separation(measured, 0.29) is None


@pytest.mark.parametrize("measured", [28.5, 0.0285])
def test_a_separation_in_another_unit_is_doubted(measured: float) -> None:
    found = implausible_separation(measured, 0.29)
    assert found is not None
    assert found.rule == "SENSE003"
