"""Every sensor and actuator of every type, against robots that were written from the manuals, not the types.

What is expected here is worked out from the manuals' own units: a robot at rest on a level floor, its battery
at four fifths, one wall 0.3 m ahead of its centre.
"""

from __future__ import annotations

import math

import pytest
from swarm_onboard.driver import readings

from swarmctl.lab.emulators.differential_drive import Wall
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.spec.catalog import load_catalog
from tests.onboard.driver.emulated_robots import Emulated
from tests.onboard.driver.fakes import TYPES, config_for

AHEAD = (Wall(0.3, -2.0, 0.3, 2.0),)
G = 9.80665


def seen(robot: Emulated, name: str) -> dict[str, float]:
    """Metres by element."""
    sensor = robot.config.sensor(name)
    table = readings.Distances(sensor.settings)
    raw = readings.whole(
        readings.every(robot.read(name), sensor.settings["stride"]), sensor.settings["max_reading"]
    )
    names = [one["name"] for one in sensor.settings["elements"]]
    return {one: table.metres(value) for one, value in zip(names, raw, strict=True)}


def scaled(robot: Emulated, name: str) -> list[float]:
    return readings.scaled(robot.read(name), robot.config.sensor(name).settings)


def volts(robot: Emulated) -> readings.Charge:
    return readings.charge(robot.read("battery"), robot.config.sensor("battery").settings)


@pytest.mark.parametrize("type_name", TYPES)
def test_every_sensor_of_a_type_is_read(type_name: str) -> None:
    everything = dict.fromkeys(with_protocol(load_catalog().types)[type_name].sensors, 1.0)
    robot = Emulated(type_name, config_for(type_name, rates=everything))
    robot.set_up()
    for sensor in robot.config.sensors:
        values = robot.read(sensor.name)
        assert len(values) == sensor.count, sensor.name
        assert all(math.isfinite(value) for value in values), sensor.name
    assert (robot.tally.failed_exchanges, robot.tally.noise_lines) == (0, 0)


@pytest.mark.parametrize("type_name", TYPES)
def test_every_battery_is_between_empty_and_full(type_name: str) -> None:
    """Four fifths of what the robots' batteries hold: 12 V, 24 V, two and one cells of LiPo."""
    low, high = {"koala": (12, 13), "koala-2.5": (24, 27), "khepera3": (7.2, 8.2)}.get(type_name, (3.6, 4.2))
    charge = volts(Emulated(type_name))
    assert low <= charge.volts <= high
    assert 0.5 <= charge.share <= 0.95


@pytest.mark.parametrize("type_name", TYPES)
@pytest.mark.parametrize("share", [0.05, 0.5, 1.0])
def test_a_battery_is_read_as_it_was_set(type_name: str, share: float) -> None:
    assert volts(Emulated(type_name, battery=share)).share == pytest.approx(share, abs=0.04)


def test_the_koala_sees_a_wall_ahead_and_nothing_elsewhere():
    robot = Emulated("koala", walls=AHEAD)
    metres = seen(robot, "proximity")
    assert metres["L0"] == pytest.approx((0.3 - 0.175) / math.cos(math.radians(5.7)), abs=0.02)
    assert {metres[name] for name in ("L5", "L7", "R4")} == {math.inf}


@pytest.mark.parametrize("type_name", ["epuck-binary", "epuck2"])
@pytest.mark.parametrize(
    ("camera", "mode", "size"),
    [
        ({}, 0, 1600),
        ({"encoding": "rgb565"}, 1, 3200),
        ({"width": 60, "height": 20, "zoom": 4}, 0, 1200),
        ({"width": 320, "height": 10, "zoom": 1}, 0, 3200),  # a width of two bytes, of which one comes back
    ],
)
def test_every_pixel_of_an_image_is_the_robots(type_name, camera, mode, size):
    robot = Emulated(type_name, config_for(type_name, rates={"camera": 1.0}, camera=camera))
    robot.set_up()
    made: list[bytes] = []
    image = robot.robot.image
    robot.robot.image = lambda: made.append(image()) or made[-1]
    pixels = robot.read("camera")
    assert bytes(pixels) == made[0][3:]
    expected = {"width": 40, "height": 40, "zoom": 8, **camera}
    assert robot.robot.image_settings == [mode, expected["width"], expected["height"], expected["zoom"]]
    assert len(pixels) == size
    assert robot.tally.failed_exchanges == 0


@pytest.mark.parametrize("type_name", ["koala", "khepera3", "epuck", "epuck-binary", "epuck2"])
def test_where_nothing_is_no_infrared_sensor_sees_anything(type_name):
    assert set(seen(Emulated(type_name), "proximity").values()) == {math.inf}


@pytest.mark.parametrize(
    ("type_name", "element", "x", "metres", "within"),
    [
        ("khepera3", "front_left", 0.15, 0.082, 0.004),  # 8 cm along its 13 degrees
        # The emulator follows GCtronic's 0.5 / sqrt(raw), the type file Cyberbotics' table: 8 mm apart here.
        ("epuck", "P0", 0.055, 0.0203, 0.009),
        ("epuck-binary", "P7", 0.055, 0.0203, 0.009),
        ("epuck2", "P0", 0.055, 0.0203, 0.009),
    ],
)
def test_a_wall_nearby_is_as_far_as_it_is(type_name, element, x, metres, within):
    robot = Emulated(type_name, walls=(Wall(x, -2.0, x, 2.0),))
    assert seen(robot, "proximity")[element] == pytest.approx(metres, abs=within)


def test_ultrasound_is_in_centimetres_and_misses_near_objects():
    robot = Emulated("koala-2.5", walls=(Wall(1.175, -1.0, 1.175, 1.0),))
    metres = seen(robot, "ultrasound")
    assert metres["front"] == pytest.approx(1.0, abs=0.02)
    assert metres["back_left"] == math.inf
    near = seen(Emulated("koala-2.5", walls=(Wall(0.3, -1.0, 0.3, 1.0),)), "ultrasound")
    assert near["front"] == -math.inf
    robot.wire.write(b"C,1,0\r")
    assert math.isnan(seen(robot, "ultrasound")["front"]), "what is turned off sees no open space"


def test_the_ultrasound_of_a_khepera_works_on_all_sides_after_setup():
    robot = Emulated("khepera3", walls=(Wall(-1.0, 1.0, 1.0, 1.0),))
    assert seen(robot, "ultrasound_left")["left"] == math.inf
    robot.set_up()
    assert seen(robot, "ultrasound_left")["left"] == pytest.approx(1.0, abs=0.03)


def test_time_of_flight_is_millimetres():
    robot = Emulated("epuck2", walls=AHEAD)
    assert seen(robot, "tof")["front"] == pytest.approx(0.265, abs=0.002)
    assert seen(Emulated("epuck2"), "tof")["front"] == math.inf


@pytest.mark.parametrize(
    ("type_name", "sensor"),
    [
        ("epuck", "accelerometer"),
        ("epuck-binary", "accelerometer"),
        ("epuck2", "imu"),
        ("koala-2.5", "accelerometer"),
    ],
)
def test_a_robot_at_rest_is_pushed_up_by_the_floor(type_name, sensor):
    robot = Emulated(type_name)
    motion = readings.motion(robot.read(sensor), robot.config.sensor(sensor).settings)
    assert motion.acceleration == pytest.approx((0.0, 0.0, G), abs=0.02)


@pytest.mark.parametrize(
    ("type_name", "sensor"),
    [
        ("epuck", "gyroscope"),
        ("epuck-binary", "gyroscope"),
        ("epuck2", "imu"),
        ("koala-2.5", "gyroscope"),
    ],
)
def test_a_gyroscope_counts_to_the_left(type_name, sensor):
    robot = Emulated(type_name)
    robot.robot.chassis.drive(-0.02, 0.02)
    robot.robot.advance(0.5)
    motion = readings.motion(robot.read(sensor), robot.config.sensor(sensor).settings)
    assert motion.rotation == pytest.approx((0.0, 0.0, robot.robot.chassis.omega), abs=0.01)


@pytest.mark.parametrize("type_name", ["koala-2.5", "epuck2"])
def test_the_magnetic_field_is_that_of_the_earth(type_name):
    """25 to 65 microtesla, and in the northern half downwards; NOAA's figures."""
    robot = Emulated(type_name)
    x, y, z = readings.vector(robot.read("magnetic"), robot.config.sensor("magnetic").settings["axes"])
    assert 25e-6 <= math.hypot(x, y, z) <= 65e-6
    assert z < 0


@pytest.mark.parametrize(
    ("type_name", "sensor", "low", "high"),
    [
        ("koala", "temperature", 10, 40),
        ("koala", "battery_temperature", 10, 40),
        ("koala", "current", 0.1, 3),
        ("koala", "current_left", 0.01, 3),
        ("koala", "current_right", 0.01, 3),
        ("koala-2.5", "current", 0.1, 3),
        ("koala-2.5", "motor_current", 0.05, 3),
        ("koala-2.5", "charging_current", 0, 0),
        ("khepera3", "current", -1, -0.1),
        ("khepera3", "battery_charge", 0.5, 1.4),
        ("khepera3", "battery_temperature", 10, 40),
        ("epuck-binary", "temperature", 10, 40),
        ("epuck2", "temperature", 10, 50),
        ("epuck2", "tilt", -math.pi, 2 * math.pi),
    ],
)
def test_quantities_have_the_size_that_they_have_in_life(type_name, sensor, low, high):
    assert all(low <= value <= high for value in scaled(Emulated(type_name), sensor))


@pytest.mark.parametrize("type_name", ["koala", "koala-2.5"])
def test_the_speed_that_a_robot_measures_is_the_one_it_goes(type_name):
    robot = Emulated(type_name)
    robot.robot.chassis.drive(0.1, 0.2)
    robot.robot.advance(1.0)
    assert scaled(robot, "wheel_speed") == pytest.approx([0.1, 0.2], abs=0.005)


@pytest.mark.parametrize(("type_name", "position"), [("epuck", 3), ("epuck2", 3)])
def test_the_selector_says_where_it_stands(type_name, position):
    assert Emulated(type_name).read("selector") == (position,)


@pytest.mark.parametrize("type_name", TYPES)
def test_every_light_is_set_and_each_request_is_understood(type_name):
    robot = Emulated(type_name)
    for actuator in robot.config.actuators:
        robot.set(actuator.name, *[actuator.max] * len(actuator.channels))
        if actuator.name == "sound":
            assert robot.robot.state.sound == actuator.max
            continue
        lit = sum(value > 0 for value in robot.robot.state.lights.values())
        assert lit >= len(actuator.channels), actuator.name
        robot.set(actuator.name, *[0] * len(actuator.channels))
        dark = sum(value > 0 for value in robot.robot.state.lights.values())
        assert lit - dark >= len(actuator.channels), actuator.name


def test_one_light_of_many_is_set_alone():
    robot = Emulated("epuck2")
    robot.set("colours", 0, 0, 0, 0, 0, 0, 0, 70, 0, 0, 0, 0)
    assert {name: value for name, value in robot.robot.state.lights.items() if value} == {"led5_green": 70}
