"""What the gate makes of a commanded velocity: axes that the robot has, within its limits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.command.limits import STANDSTILL, Velocity
from swarm_onboard.gate.motion import AXES, Motion, limited, on_axes

BURGER = Motion("differential", 0.22, 0.0, 0.0, 2.84, wheel_separation=0.16)
UNMEASURED = Motion("differential", 0.22, 0.0, 0.0, 2.84)
CAR = Motion("ackermann", 2.0, 0.0, 0.0, 1.5, turning_radius=0.8)
BASE = Motion("holonomic", 0.5, 0.3, 0.0, 1.0)
DOG = Motion("legged", 1.0, 0.4, 0.0, 1.2)
DRONE = Motion("aerial", 1.0, 1.0, 0.5, 1.5)
ALL = (BURGER, UNMEASURED, CAR, BASE, DOG, DRONE)
COMPONENTS = st.floats(-999, 999, allow_nan=False).map(lambda one: 0.0 if abs(one) < 1e-9 else one)
VELOCITIES = st.builds(Velocity, *[COMPONENTS] * 6)
A_LITTLE = 1 + 1e-9  # what rounding may add


@pytest.mark.parametrize(
    ("motion", "wanted", "got"),
    [
        (BURGER, Velocity(forward=0.1, turn=0.5), Velocity(forward=0.1, turn=0.5)),
        (BURGER, Velocity(forward=0.44), Velocity(forward=0.22)),
        (BURGER, Velocity(turn=-5.68), Velocity(turn=-2.84)),
        # The right wheel would go at 0.22 + 0.08 * 2.75 = 0.44 m/s and may go at 0.2272.
        (BURGER, Velocity(0.22, turn=2.75), Velocity(0.22 * 0.2272 / 0.44, turn=2.75 * 0.2272 / 0.44)),
        (UNMEASURED, Velocity(forward=0.44, turn=2.84), Velocity(forward=0.22, turn=1.42)),
        (BASE, Velocity(forward=0.5, left=-0.6, turn=0.2), Velocity(forward=0.25, left=-0.3, turn=0.1)),
        (DRONE, Velocity(up=-1.0, turn=1.5), Velocity(up=-0.5, turn=0.75)),
        (CAR, Velocity(turn=1.0), STANDSTILL),
        (CAR, Velocity(forward=0.4, turn=1.0), Velocity(forward=0.4, turn=0.5)),
        (CAR, Velocity(forward=-0.4, turn=1.0), Velocity(forward=-0.4, turn=0.5)),
        (CAR, Velocity(forward=4.0, turn=1.0), Velocity(forward=2.0, turn=0.5)),
    ],
)
def test_a_velocity_is_slowed_along_its_curve(motion, wanted, got):
    assert limited(wanted, motion) == pytest.approx(got)


@pytest.mark.parametrize("motion", ALL, ids=lambda one: one.kind)
def test_axes_that_a_robot_lacks_are_zero(motion):
    every = Velocity(1, 1, 1, 1, 1, 1)
    kept = on_axes(every, motion)
    assert {axis for axis in Velocity._fields if getattr(kept, axis)} == set(AXES[motion.kind])


@given(VELOCITIES, st.sampled_from(ALL))
def test_no_axis_exceeds_its_limit_or_changes_its_sign(wanted, motion):
    got = limited(on_axes(wanted, motion), motion)
    most = Velocity(motion.linear_max, motion.lateral_max, motion.vertical_max, 0, 0, motion.angular_max)
    for one, before, limit in zip(got, wanted, most, strict=True):
        assert abs(one) <= min(limit, abs(before)) * A_LITTLE
        assert one * before >= 0


@given(VELOCITIES, st.sampled_from((BURGER, UNMEASURED, BASE, DOG, DRONE)))
def test_all_axes_keep_their_ratio(wanted, motion):
    possible = on_axes(wanted, motion)
    got = limited(possible, motion)
    factors = [one / before for one, before in zip(got, possible, strict=True) if before]
    assert all(math.isclose(one, factors[0], rel_tol=1e-9) for one in factors)


@given(VELOCITIES)
def test_a_wheel_goes_no_faster_than_either_limit_needs(wanted):
    got = limited(on_axes(wanted, BURGER), BURGER)
    assert abs(got.forward) + abs(got.turn) * 0.08 <= max(0.22, 2.84 * 0.08) * A_LITTLE


@given(VELOCITIES)
def test_a_car_keeps_its_curve_and_its_turning_radius(wanted):
    got = limited(on_axes(wanted, CAR), CAR)
    assert abs(got.turn) * 0.8 <= abs(got.forward) * A_LITTLE
    if abs(wanted.turn) * 0.8 <= abs(wanted.forward) and wanted.forward:
        assert got.turn * wanted.forward == pytest.approx(wanted.turn * got.forward)


@given(VELOCITIES, st.sampled_from(ALL))
def test_what_is_within_the_limits_is_passed_on_unchanged(wanted, motion):
    slow = limited(on_axes(wanted, motion), motion)
    assert limited(slow, motion) == pytest.approx(slow)
