"""From raw numbers to metres, volts and metres per second squared."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.driver import readings
from swarm_onboard.driver.readings import Distances

from tests.onboard.driver.fakes import TYPES, config_for

INFRARED = {"distances": [[120, 0.05], [235, 0.03], [4095, 0.0]]}  # larger is nearer
ULTRASOUND = {"distances": [[25, 0.25], [250, 2.5]], "none_from": 1000, "invalid_from": 2000}  # centimetres
ECHOES = {"distances": [[20, 0.2], [400, 4.0]], "none_below": 1}


@pytest.mark.parametrize(
    ("settings", "reading", "metres"),
    [
        (INFRARED, 120, 0.05),
        (INFRARED, 177.5, 0.04),
        (INFRARED, 4095, 0.0),
        (INFRARED, 119, math.inf),
        (INFRARED, 4096, -math.inf),
        (ULTRASOUND, 25, 0.25),
        (ULTRASOUND, 100, 1.0),
        (ULTRASOUND, 24, -math.inf),
        (ULTRASOUND, 0, -math.inf),
        (ULTRASOUND, 251, math.inf),
        (ULTRASOUND, 1000, math.inf),
        (ECHOES, 0, math.inf),
        (ECHOES, 1, -math.inf),
    ],
)
def test_a_reading_is_a_distance_or_says_on_which_side_it_lies(settings, reading, metres):
    assert Distances(settings).metres(reading) == pytest.approx(metres)


def test_a_sensor_that_is_off_sees_neither_an_obstacle_nor_open_space():
    assert math.isnan(Distances(ULTRASOUND).metres(2000))


RANGES = [(name, one) for name in TYPES for one in config_for(name).sensors if one.kind == "range"]


@pytest.mark.parametrize(("type_name", "sensor"), RANGES, ids=lambda one: getattr(one, "name", one))
@given(reading=st.integers(0, 65535))
def test_every_distance_is_within_the_sensors_limits_or_infinite(type_name, sensor, reading):
    table = Distances(sensor.settings)
    [raw] = readings.whole([reading], sensor.settings["max_reading"])
    metres = table.metres(raw)
    assert not math.isfinite(metres) or table.nearest <= metres <= table.farthest


@pytest.mark.parametrize(("type_name", "sensor"), RANGES, ids=lambda one: getattr(one, "name", one))
def test_distances_never_turn_back(type_name, sensor):
    table = Distances(sensor.settings)
    pairs = sensor.settings["distances"]
    between = range(math.ceil(pairs[0][0]), math.floor(pairs[-1][0]) + 1)
    metres = [table.metres(reading) for reading in between]
    assert metres == sorted(metres, reverse=pairs[0][1] > pairs[-1][1])


def test_a_robots_own_order_of_axes_becomes_x_forward_y_left_z_up():
    axes = {"first": 1, "order": [1, 0, 2], "zero": [0, 2, 0], "scale": [1.0, -1.0, 2.0]}
    assert readings.vector((99, 10, 20, 30), axes) == (20.0, -8.0, 60.0)


def test_what_is_not_measured_is_none():
    axes = {"first": 0, "order": [0, 1, 2], "zero": [0, 0, 0], "scale": [1.0, 1.0, 1.0]}
    assert readings.motion((1, 2, 3), {"rotation": axes}) == readings.Motion(None, (1.0, 2.0, 3.0))


def test_whole_volts_and_their_decimals_make_one_voltage():
    settings = {"volts": [1.0, 0.0001], "offset": 0.0, "empty": 6.4, "full": 8.4}
    charge = readings.charge((7, 4000), settings)
    assert (charge.volts, charge.share) == (pytest.approx(7.4), pytest.approx(0.5))
    assert readings.charge((9, 0), settings).share == 1.0
    assert readings.charge((5, 0), settings).share == 0.0


def test_numbers_of_a_message_of_sixteen_bits_fit_into_it():
    assert readings.whole([-3, 70_000, 12.7]) == [0, 65535, 12]
    assert readings.whole([5000], 4095) == [4095]


def test_a_lens_maps_the_edge_of_its_view_to_that_of_the_image():
    focal = config_for("epuck-binary").sensor("camera").settings["focal"]
    lens = readings.pinhole(40, 40, focal)
    assert 2 * math.degrees(math.atan(640 / 8 / 2 / focal)) == pytest.approx(48)
    assert lens["K"] == [focal, 0.0, 19.5, 0.0, focal, 19.5, 0.0, 0.0, 1.0]
    assert [lens["P"][row : row + 3] for row in (0, 4, 8)] == [lens["K"][row : row + 3] for row in (0, 3, 6)]
    assert readings.pinhole(41, 21, focal)["K"][2::3] == [20.0, 10.0, 1.0]


def test_a_lens_that_is_not_known_is_not_calibrated():
    lens = readings.pinhole(40, 30, None)
    assert not any(number for matrix in lens.values() for number in matrix)
    assert {name: len(matrix) for name, matrix in lens.items()} == {"K": 9, "R": 9, "P": 12}
