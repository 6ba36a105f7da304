"""What the poses of a trial show: whether a goal was reached, and how far a robot drove."""

from __future__ import annotations

import math
import random
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.capsule.capsule_index import Judged
from swarmctl.capsule.success import judge
from swarmctl.capsule.trajectory import RecordedTopic, Sample, from_start, nearest, path_length
from swarmctl.spec.experiment_model import Criterion, Goal

REACHED = Criterion(topic="k3/odom", reached=Goal(x=1.0, y=0.0, within=0.1))


def moved(*places: tuple[float, float], yaw: float = 0.0) -> list[Sample]:
    return [Sample(float(number), x, y, yaw) for number, (x, y) in enumerate(places)]


def topic(samples: list[Sample], *, odometry: bool = True) -> RecordedTopic:
    return RecordedTopic(len(samples), odometry, samples)


def only(criterion: Criterion, seen: dict[str, RecordedTopic]) -> Judged:
    (one,) = judge([criterion], seen)
    return one


def test_the_goal_of_odometry_is_ahead_of_where_the_robot_stood() -> None:
    north = moved((5.0, 5.0), (5.0, 5.5), (5.0, 6.05), yaw=math.pi / 2)
    judged = only(REACHED, {"/k3/odom": topic(north)})
    assert judged.found == pytest.approx(0.05)
    assert judged == Judged(topic="k3/odom", condition="reached", wanted=0.1, found=judged.found, met=True)
    assert not only(REACHED, {"/k3/odom": topic(moved((5.0, 5.0), (5.0, 6.05)))}).met


def test_other_poses_are_taken_as_they_are() -> None:
    seen = {"/k3/odom": topic(moved((5.0, 5.0), (0.95, 0.0), (5.0, 5.0)), odometry=False)}
    judged = only(REACHED, seen)
    assert (judged.found, judged.met) == (pytest.approx(0.05), True)


@pytest.mark.parametrize(("end", "met"), [(0.75, True), (0.74, False)])
def test_the_border_of_the_goal_belongs_to_it(end: float, met: bool) -> None:
    goal = Criterion(topic="k3/odom", reached=Goal(x=1.0, y=0.0, within=0.25))
    assert only(goal, {"/k3/odom": topic(moved((0.0, 0.0), (end, 0.0)))}).met is met


def test_all_conditions_of_a_criterion_are_judged() -> None:
    criterion = Criterion(topic="/k3/odom", reached=Goal(x=0.0, y=0.0, within=0.1), distance=2.0, count=4)
    there_and_back = topic(moved((0.0, 0.0), (1.0, 0.0), (0.0, 0.0)))
    judged = judge([criterion], {"/k3/odom": there_and_back})
    assert [(one.condition, one.wanted, one.found, one.met) for one in judged] == [
        ("reached", 0.1, 0.0, True), ("distance", 2.0, 2.0, True), ("count", 4.0, 3.0, False),
    ]  # fmt: skip


def test_nothing_is_found_of_a_topic_without_messages_or_poses() -> None:
    criterion = Criterion(topic="k3/odom", reached=Goal(x=0.0, y=0.0, within=0.1), distance=1.0, count=1)
    assert [(one.found, one.met) for one in judge([criterion], {})] == [(None, False)] * 3
    scans = RecordedTopic(messages=7)
    judged = judge([criterion], {"/k3/odom": scans})
    assert [(one.found, one.met) for one in judged] == [(None, False), (None, False), (7.0, True)]


def test_amounts_fit_an_index() -> None:
    far = topic([Sample(0.0, 0.0, 0.0, 0.0), *(Sample(1.0, side * 1e9, 0.0, 0.0) for side in (1, -1) * 1000)])
    assert only(Criterion(topic="k3/odom", distance=1e13), {"/k3/odom": far}) == Judged(
        topic="k3/odom", condition="distance", wanted=1e12, found=1e12, met=False
    )


def test_noise_of_a_standing_robot_is_no_path() -> None:
    noise = random.Random(7)
    standing = moved(*((noise.uniform(-1e-3, 1e-3), noise.uniform(-1e-3, 1e-3)) for _ in range(10_000)))
    assert path_length(standing) < 0.005


def test_slow_driving_is_a_path() -> None:
    """1 cm/s at 100 Hz: each step is 0.1 mm."""
    assert path_length(moved(*((number / 10_000, 0.0) for number in range(10_001)))) == pytest.approx(1.0)


def test_a_circle_is_as_long_as_its_circumference() -> None:
    around = (2 * math.pi * number / 3000 for number in range(3001))
    circle = moved(*((0.3 * math.cos(angle), 0.3 * math.sin(angle)) for angle in around))
    assert path_length(circle) == pytest.approx(2 * math.pi * 0.3, rel=1e-4)


COORDINATE = st.floats(-20, 20)
PATHS = st.lists(st.tuples(COORDINATE, COORDINATE, st.floats(-math.pi, math.pi)), min_size=1, max_size=30)
FRAME = st.tuples(COORDINATE, COORDINATE, st.floats(-math.pi, math.pi))


def samples(path: list[tuple[float, float, float]]) -> list[Sample]:
    return [Sample(float(number), *pose) for number, pose in enumerate(path)]


def placed(path: list[Sample], x: float, y: float, turned: float) -> list[Sample]:
    """The same path in another frame of odometry, which turned and moved."""
    along, across = math.cos(turned), math.sin(turned)
    return [
        one._replace(
            x=x + along * one.x - across * one.y, y=y + across * one.x + along * one.y, yaw=one.yaw + turned
        )
        for one in path
    ]


@given(PATHS, FRAME, COORDINATE, COORDINATE)
def test_where_odometry_began_changes_nothing(
    path: list[tuple[float, float, float]], frame: tuple[float, float, float], x: float, y: float
) -> None:
    one, other = from_start(samples(path)), from_start(placed(samples(path), *frame))
    for here, there in zip(one, other, strict=True):
        assert (here.x, here.y) == pytest.approx((there.x, there.y), abs=1e-9)
        assert math.cos(here.yaw - there.yaw) == pytest.approx(1)
    assert nearest(one, x, y) == pytest.approx(nearest(other, x, y), abs=1e-9)
    assert one[0][1:4] == (0.0, 0.0, 0.0)


@given(PATHS, FRAME)
def test_a_path_is_at_most_the_sum_of_its_steps(
    path: list[tuple[float, float, float]], frame: tuple[float, float, float]
) -> None:
    """At least, it is as long as to the sample that is farthest away, less a step."""
    found = samples(path)
    length = path_length(found)
    steps = (math.hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(found))
    assert length <= sum(steps) + 1e-9
    assert length > max(math.hypot(one.x - found[0].x, one.y - found[0].y) for one in found) - 0.005 - 1e-9
    assert path_length(found[::-1]) == pytest.approx(length, abs=0.01 * len(found))


@given(st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, 20)), min_size=1, max_size=30), FRAME)
def test_long_steps_add_up_in_every_frame(
    places: list[tuple[int, int]], frame: tuple[float, float, float]
) -> None:
    found = moved(*((float(x), float(y)) for x, y in places))
    steps = sum(math.dist(a, b) for a, b in pairwise(places))
    assert path_length(found) == pytest.approx(steps, abs=1e-9)
    assert path_length(placed(found, *frame)) == pytest.approx(steps, abs=1e-9)


@given(PATHS)
def test_a_goal_on_the_path_is_reached(path: list[tuple[float, float, float]]) -> None:
    for one in from_start(samples(path)):
        goal = Criterion(topic="k3/odom", reached=Goal(x=one.x, y=one.y, within=1e-6))
        assert only(goal, {"/k3/odom": topic(samples(path))}).met
