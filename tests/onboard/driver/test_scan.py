"""Distance sensors as rays of a scan: obstacles where they are, seen from the robot's centre."""

from __future__ import annotations

import math

import pytest
from swarm_onboard.driver.scan import FIRST, RAYS, STEP, Scan

from tests.onboard.driver.fakes import TYPES, config_for

NONE = math.inf
ARRAY = {
    "distances": [[100, 1.0], [4000, 0.1]],
    "elements": [
        {"name": "front", "x": 0.1, "y": 0.0, "z": 0.0, "heading_deg": 0},
        {"name": "left", "x": 0.1, "y": 0.1, "z": 0.0, "heading_deg": 90},
        {"name": "back", "x": -0.1, "y": 0.0, "z": 0.0, "heading_deg": 180},
    ],
}


def points(ranges: list[float]) -> list[tuple[float, float]]:
    """Where a subscriber that knows only the message puts what is seen."""
    angles = [FIRST + ray * STEP for ray in range(RAYS)]
    return [
        (one * math.cos(angle), one * math.sin(angle))
        for one, angle in zip(ranges, angles, strict=True)
        if math.isfinite(one)
    ]


def test_an_obstacle_is_where_its_sensor_sees_it() -> None:
    ranges = Scan(ARRAY).ranges([0.4, 0.3, 0.2])
    seen = sorted(points(ranges))
    expected = sorted([(0.5, 0.0), (0.1, 0.4), (-0.3, 0.0)])
    for (x, y), (true_x, true_y) in zip(seen, expected, strict=True):
        assert math.hypot(x - true_x, y - true_y) <= 0.5 * STEP * 0.5


def test_nothing_in_sight_is_infinite_and_unseen_is_no_number() -> None:
    ranges = Scan(ARRAY).ranges([NONE, NONE, NONE])
    assert sum(one == math.inf for one in ranges) == 3
    assert sum(math.isnan(one) for one in ranges) == RAYS - 3
    assert ranges[RAYS // 2] == math.inf, "straight ahead"
    assert ranges[0] == math.inf, "straight behind"


def test_a_sensor_without_a_reading_says_nothing() -> None:
    assert all(math.isnan(one) for one in Scan(ARRAY).ranges([math.nan] * 3))


def test_what_is_too_near_to_measure_is_near() -> None:
    ranges = Scan(ARRAY).ranges([-math.inf, NONE, NONE])
    assert ranges[RAYS // 2] == pytest.approx(0.2)


def test_of_two_sensors_on_one_ray_the_nearer_object_counts() -> None:
    doubled = {**ARRAY, "elements": [ARRAY["elements"][0], ARRAY["elements"][0]]}
    for distances in ([0.3, NONE], [NONE, 0.3], [0.3, 0.8], [0.8, 0.3]):
        assert Scan(doubled).ranges(distances)[RAYS // 2] == pytest.approx(0.4)


@pytest.mark.parametrize("type_name", TYPES)
def test_what_a_robot_can_measure_is_within_the_limits_of_its_scan(type_name: str) -> None:
    for sensor in config_for(type_name).sensors:
        if sensor.kind == "range":
            scan, ends = Scan(sensor.settings), [metres for _, metres in sensor.settings["distances"]]
            for end in ends:
                seen = [one for one in scan.ranges([end] * sensor.count) if math.isfinite(one)]
                assert seen
                assert all(scan.nearest <= one <= scan.farthest for one in seen)
