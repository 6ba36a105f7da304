"""The body of a stand-in moves as its kinematics says, for as long as nobody sends another command."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.stand_in.body import Body, Pose

EVERY_AXIS = (1.0, 1.0, 1.0, 4.0)
speeds = st.floats(-1.0, 1.0)


def after(axes: tuple[float, float, float, float], seconds: float) -> Pose:
    body = Body(EVERY_AXIS)
    body.command(axes)
    body.advance(seconds)
    return body.pose


@pytest.mark.parametrize(
    ("axes", "end"),
    [
        ((0.5, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ((0.0, 0.5, 0.0, 0.0), (0.0, 1.0, 0.0)),
        ((0.0, 0.0, 0.5, 0.0), (0.0, 0.0, 1.0)),
        ((math.pi / 4, 0.0, 0.0, math.pi / 4), (1.0, 1.0, 0.0)),  # a quarter of a circle of 1 m to the left
        ((0.0, math.pi / 4, 0.0, math.pi / 4), (-1.0, 1.0, 0.0)),  # the same, sideways
    ],
)
def test_two_seconds_end_where_the_arc_does(
    axes: tuple[float, float, float, float], end: tuple[float, float, float]
) -> None:
    pose = after(axes, 2.0)
    assert (pose.x, pose.y, pose.z) == pytest.approx(end, abs=1e-9)


@given(st.tuples(speeds, speeds, speeds, speeds), st.integers(2, 20))
def test_small_steps_end_where_one_large_step_does(
    axes: tuple[float, float, float, float], steps: int
) -> None:
    body = Body(EVERY_AXIS)
    body.command(axes)
    for _ in range(steps):
        body.advance(1.0 / steps)
    whole = after(axes, 1.0)
    assert (body.pose.x, body.pose.y, body.pose.theta) == pytest.approx(
        (whole.x, whole.y, whole.theta), abs=1e-6
    )


def test_it_obeys_its_last_command_for_ever() -> None:
    assert after((0.2, 0.0, 0.0, 0.0), 3600.0).x == pytest.approx(720.0)


def test_each_axis_has_its_own_limit() -> None:
    body = Body((0.22, 0.0, 0.0, 2.84))
    body.command((0.77, 0.5, 0.5, -9.0))
    assert body.velocity == (0.22, 0.0, 0.0, -2.84)


def test_a_command_that_is_no_number_changes_nothing() -> None:
    body = Body(EVERY_AXIS)
    body.command((0.2, 0.0, 0.0, 0.0))
    body.command((math.nan, 0.0, 0.0, 0.0))
    assert body.velocity == (0.2, 0.0, 0.0, 0.0)
    assert body.commands == 2
