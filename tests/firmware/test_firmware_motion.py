"""How the real firmware drives: motors that differ, slotted discs, and the true path beside the pulses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from firmware_bench import RADIUS, Bench

from swarmctl.firmware.build import Built
from swarmctl.lab.emulators.board import SimulatedBoard
from swarmctl.lab.emulators.uno import LEFT, RIGHT, Motor
from swarmctl.render.firmware import FirmwareSettings
from swarmctl.spec.firmware import Firmware, WheelDrive, completed

Benches = Callable[..., Bench]
WEAK = replace(LEFT, free=0.8 * LEFT.free, dead=80.0, lag=0.2)  # beside a motor as the firmware expects it


@pytest.mark.parametrize("motor", [LEFT, WEAK], ids=["as expected", "weak"])
@pytest.mark.parametrize("speed", [0.05, 0.1, 0.2, 0.4])
def test_a_wheel_reaches_the_speed_ordered(bench: Benches, speed: float, motor: Motor) -> None:
    rover = bench(left=motor)
    rover.run(2.0, (speed, 0.0))
    assert rover.drive(speed, 0.0, 2.0) == (pytest.approx(speed, rel=0.05), pytest.approx(speed, rel=0.05))


def test_a_weak_motor_that_is_known_to_be_weak_starts_straight(
    boards: Callable[..., SimulatedBoard], build_firmware: Callable[[FirmwareSettings], Built]
) -> None:
    known = completed(Firmware(left=WheelDrive(pwm_min=WEAK.dead, full_speed=WEAK.free * RADIUS)))
    firmware = build_firmware(FirmwareSettings(known))
    rover = Bench(boards(firmware.hex, left=WEAK)).negotiated()
    rover.run(3.0, (0.3, 0.0))
    assert abs(rover.board.state.theta) < math.radians(3)


def test_backwards_too(bench: Benches) -> None:
    rover = bench()
    rover.run(1.5, (-0.2, 0.0))
    assert rover.drive(-0.2, 0.0, 1.0) == (pytest.approx(-0.2, rel=0.05), pytest.approx(-0.2, rel=0.05))


def test_equation_2_has_the_radius_in_it(bench: Benches) -> None:
    rover = bench()
    rover.run(2.0, (0.1, 1.0))
    left, right = rover.drive(0.1, 1.0, 3.0)
    assert left / 0.0325 == pytest.approx(1.077, rel=0.08)  # rad/s
    assert right / 0.0325 == pytest.approx(5.077, rel=0.05)


def test_motors_that_differ_drive_straight(bench: Benches) -> None:
    rover = bench(left=WEAK)
    rover.run(2.0, (0.2, 0.0))
    after_start = rover.board.state.theta
    rover.run(8.0, (0.2, 0.0))
    assert abs(after_start) < math.radians(12), "while the loops find out what each motor needs"
    assert rover.board.state.theta == pytest.approx(after_start, abs=math.radians(2)), "and then no more"


def test_beyond_the_limit_the_curve_is_kept(bench: Benches) -> None:
    rover = bench()
    rover.run(2.0, (2.0, 4.0))  # 1.74 and 2.26 m/s, where 0.5 is allowed
    left, right = rover.drive(2.0, 4.0, 2.0)
    assert right == pytest.approx(0.5, rel=0.04)
    assert left / right == pytest.approx(1.74 / 2.26, rel=0.04)


def test_load_is_made_up_for(bench: Benches) -> None:
    rover = bench()
    rover.board.load = (0.1, 0.2)
    rover.run(2.5, (0.2, 0.0))
    assert rover.drive(0.2, 0.0, 2.0) == (pytest.approx(0.2, rel=0.05), pytest.approx(0.2, rel=0.05))


def test_pulses_know_the_way_back(bench: Benches) -> None:
    rover = bench()
    for _ in range(3):
        rover.run(1.5, (0.3, 0.0))
        rover.run(1.5, (-0.3, 0.0))
    rover.run(1.0)
    for topic, angle in zip(("lwheel", "rwheel"), rover.board.truth.angles, strict=True):
        assert rover.ticks(topic)[-1] == pytest.approx(angle / (2 * math.pi) * 20, abs=6)  # one a reversal


def test_a_standing_wheel_counts_nothing(bench: Benches) -> None:
    rover = bench()
    rover.run(1.0, (0.2, 0.0))
    rover.run(1.0)
    stood = rover.ticks("lwheel")[-1]
    rover.run(5.0)
    assert rover.ticks("lwheel")[-1] == stood


def test_odometry_agrees_with_the_true_path(bench: Benches, note: Callable[[str, str, str], None]) -> None:
    """Over a square of 2 m, with unlike motors and a host that steers by the pulses' odometry alone."""
    rover = bench(left=replace(LEFT, free=0.9 * LEFT.free, dead=70.0), right=RIGHT)
    for corner in range(1, 5):
        x, y, _ = rover.odometry()
        while math.dist(rover.odometry()[:2], (x, y)) < 2.0:
            rover.run(0.1, (0.3, 0.0))
        rover.run(0.5, (0.0, 0.0))
        while rover.odometry()[2] < corner * math.pi / 2 - 0.1:
            rover.run(0.1, (0.0, 1.0))
        rover.run(0.5, (0.0, 0.0))
    state, (x, y, theta) = rover.board.state, rover.odometry()
    apart = math.dist((state.x, state.y), (x, y))
    note("odometry against the true path, square of 2 m", f"{100 * apart / state.distance:.1f} %", "<= 5 %")
    assert state.distance == pytest.approx(8.0, abs=0.5)
    assert apart <= 0.05 * state.distance
    assert theta == pytest.approx(state.theta, abs=0.25)  # three pulses of a wheel
