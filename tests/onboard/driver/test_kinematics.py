"""Wheel commands and odometry: golden values from the robots' manuals, and what holds for any number."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from swarm_onboard.driver.kinematics import Counters, Odometry, Pose, plausible, wheel_units

from tests.onboard.driver.fakes import TYPES, config_for

KOALA = config_for("koala").kinematics
anything = st.floats(allow_nan=True, allow_infinity=True)
sensible = st.floats(-5, 5)


@pytest.mark.parametrize(
    ("type_name", "firmware", "command", "units"),
    [
        ("koala", None, (0.2, 0.0), (44, 44)),
        ("koala", None, (0.1, 0.5), (6, 38)),
        ("koala", None, (0.0, 1.0), (-32, 32)),
        ("koala", None, (0.45, 0.0), (100, 100)),
        ("khepera3", 2.1, (0.1, 0.0), (14401, 14401)),
        ("khepera3", 2.1, (0.1, 0.5), (11218, 17584)),
        ("khepera3", 2.1, (0.0, 1.0), (-6366, 6366)),
        ("khepera3", 3.0, (0.1, 0.0), (21872, 21872)),
        ("khepera3", 3.0, (0.1, 0.5), (17038, 26706)),
        ("khepera3", 3.0, (0.0, 1.0), (-9669, 9669)),
        ("epuck", None, (0.1, 0.0), (776, 776)),
        ("epuck", None, (0.0, 1.0), (-206, 206)),
    ],
)
def test_a_command_becomes_the_units_of_the_manual(type_name, firmware, command, units):
    kinematics = config_for(type_name).kinematics
    assert wheel_units(*command, kinematics, kinematics.scale_for(firmware)) == units


def test_units_that_depend_on_an_unknown_firmware_are_not_guessed():
    assert config_for("khepera3").kinematics.scale_for(None) is None


@pytest.mark.parametrize("type_name", TYPES)
@given(linear=anything, angular=anything)
def test_whatever_the_order_the_wheels_stay_within_their_limit(type_name, linear, angular):
    kinematics = config_for(type_name).kinematics
    for scale in kinematics.scales:
        limit = math.ceil(kinematics.wheel_speed_max * scale.speed_units_per_mps)
        assert all(abs(unit) <= limit for unit in wheel_units(linear, angular, kinematics, scale))


@pytest.mark.parametrize("senseless", [math.nan, math.inf, -math.inf, 1e308, -1e308])
def test_a_senseless_command_is_a_stop(senseless):
    assert wheel_units(senseless, 0.0, KOALA, KOALA.scales[0]) == (0, 0)
    assert wheel_units(0.1, senseless, KOALA, KOALA.scales[0]) == (0, 0)
    assert not plausible((0.1, 0.0, senseless))


@given(linear=sensible, angular=sensible)
def test_a_command_too_fast_keeps_its_curve(linear, angular):
    """Both wheels slow down by the same factor: each lies within half a unit of its share."""
    scale = KOALA.scales[0]
    half = angular * KOALA.wheel_separation / 2
    wanted = [(linear - half) * scale.speed_units_per_mps, (linear + half) * scale.speed_units_per_mps]
    fastest = max(map(abs, wanted))
    assume(fastest > 1)
    units = wheel_units(linear, angular, KOALA, scale)
    factor = min(1.0, KOALA.wheel_speed_max * scale.speed_units_per_mps / fastest)
    assert units == pytest.approx([factor * side for side in wanted], abs=0.51)


@given(linear=sensible, angular=sensible)
def test_limits_of_the_robot_hold_for_speed_and_turn(linear, angular):
    kinematics = config_for("koala", limits={"linear": 0.2, "angular": 0.6}).kinematics
    left, right = wheel_units(linear, angular, kinematics, kinematics.scales[0])
    unit = 1 / kinematics.scales[0].speed_units_per_mps
    assert abs(left + right) / 2 * unit <= 0.2 + unit
    assert abs(right - left) * unit / kinematics.wheel_separation <= 0.6 + unit / kinematics.wheel_separation


@given(linear=st.floats(-0.05, 0.05))
def test_a_moving_wheel_goes_no_slower_than_its_regulator_can(linear):
    kinematics = config_for("khepera3").kinematics
    slowest = round(kinematics.wheel_speed_min * 144010)
    left, right = wheel_units(linear, 0.0, kinematics, kinematics.scales[0])
    assert left == right
    assert left == 0 or abs(left) >= slowest
    assert left == 0 or math.copysign(1, left) == math.copysign(1, linear)


def test_straight_ahead_and_a_quarter_turn():
    scale = KOALA.scales[0]
    quarter = round(math.pi / 2 * KOALA.wheel_separation / 2 / scale.metres_per_count)
    ahead = (
        Odometry().update(Counters(0, 0, 0.0), KOALA, scale).update(Counters(4000, 4000, 1.0), KOALA, scale)
    )
    assert (ahead.pose.x, ahead.pose.y, ahead.pose.linear) == pytest.approx((0.18, 0.0, 0.18))
    turned = ahead.update(Counters(4000 - quarter, 4000 + quarter, 2.0), KOALA, scale)
    assert (turned.pose.x, turned.pose.y) == pytest.approx((0.18, 0.0))
    assert turned.pose.yaw == pytest.approx(math.pi / 2, abs=1e-3)
    assert turned.pose.angular == pytest.approx(math.pi / 2, abs=1e-3)


@pytest.mark.parametrize("type_name", TYPES)
@given(
    short_of_wrap=st.integers(-300, 300),
    steps=st.lists(st.tuples(st.integers(-90, 90), st.integers(-90, 90)), max_size=30),
)
def test_the_way_does_not_depend_on_where_the_counters_wrap(type_name, short_of_wrap, steps):
    kinematics = config_for(type_name).kinematics
    scale, bits = kinematics.scales[0], kinematics.counter_bits

    def drive(left: int, right: int) -> Pose:
        odometry = Odometry()
        for number, (dl, dr) in enumerate([(0, 0), *steps]):
            left, right = left + dl, right + dr
            odometry = odometry.update(
                Counters(_wrapped(left, bits), _wrapped(right, bits), number), kinematics, scale
            )
        return odometry.pose

    start = (1 << (bits - 1)) - short_of_wrap
    assert drive(start, -start) == drive(0, 0)


def _wrapped(count: int, bits: int) -> int:
    half = 1 << (bits - 1)
    return (count + half) % (2 * half) - half


def test_a_robot_that_was_reset_does_not_jump():
    scale = KOALA.scales[0]
    odometry = Odometry().update(Counters(900_000, 900_000, 0.0), KOALA, scale)
    odometry = odometry.update(Counters(901_000, 901_000, 1.0), KOALA, scale)
    after = odometry.update(Counters(0, 0, 1.1), KOALA, scale)
    assert (after.pose.x, after.jumps) == (odometry.pose.x, 1)
    assert after.update(Counters(1000, 1000, 1.2), KOALA, scale).pose.x == pytest.approx(
        odometry.pose.x + 0.045
    )


def test_no_speed_is_more_than_the_wheels_can_do():
    scale = KOALA.scales[0]
    odometry = Odometry().update(Counters(0, 0, 0.0), KOALA, scale)
    pushed = odometry.update(Counters(1000, 500, 0.05), KOALA, scale)
    assert (pushed.jumps, pushed.pose.driven) == (0, pytest.approx(0.03375))
    left = pushed.pose.linear - pushed.pose.angular * KOALA.wheel_separation / 2
    right = pushed.pose.linear + pushed.pose.angular * KOALA.wheel_separation / 2
    assert (left, right) == pytest.approx((KOALA.wheel_speed_max, KOALA.wheel_speed_max / 2))


def test_a_late_reply_makes_the_next_speed_no_faster():
    scale, trusted = KOALA.scales[0], 0.075
    odometry = Odometry()
    for count, moment in ((0, 0.0), (400, 0.1), (800, 0.285), (1200, 0.3), (1600, 0.4)):
        odometry = odometry.update(Counters(count, count, moment), KOALA, scale, trusted)
        assert odometry.pose.linear <= 0.1801
    assert odometry.pose.linear == pytest.approx(0.18)
