"""How the real firmware drives: motors that differ, slotted discs, and the true path beside the pulses."""

from __future__ import annotations

import math
import resource
from collections.abc import Callable
from dataclasses import replace
from typing import Literal, NamedTuple

import pytest

from swarmctl.firmware.compiler import Built
from swarmctl.lab.emulators.arduino_rover import SimulatedBoard
from swarmctl.lab.emulators.uno import LEFT, Motor
from swarmctl.render.sketch import FirmwareSettings
from swarmctl.robot_types.sketch_settings import Firmware, WheelDrive, completed
from tests.firmware.firmware_bench import PULSES, RADIUS, SEPARATION, Bench
from tests.timing import reference

Benches = Callable[..., Bench]
WEAK = replace(LEFT, free=0.8 * LEFT.free, dead=80.0, lag=0.2)  # beside a motor as the firmware expects it
TICK = 2 * math.pi * RADIUS / PULSES / SEPARATION  # rad that the robot turns while one wheel does a tick


@pytest.mark.parametrize("motor", [LEFT, WEAK], ids=["as expected", "weak"])
@pytest.mark.parametrize("speed", [0.05, 0.1, 0.2, 0.4])
def test_a_wheel_reaches_the_commanded_speed(bench: Benches, speed: float, motor: Motor) -> None:
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


def apart(rover: Bench) -> list[float]:
    """Ticks reported beyond those turned, left and right; the first is a quarter of a slot from the start."""
    return [
        rover.ticks(topic)[-1] - (angle / (2 * math.pi) * PULSES + 0.25)
        for topic, angle in zip(("lwheel", "rwheel"), rover.board.truth.angles, strict=True)
    ]


@pytest.mark.parametrize(("speed", "rest"), [(0.1, 0.0), (0.3, 0.3), (0.5, 0.0)])
def test_no_reversal_costs_a_tick(bench: Benches, speed: float, rest: float) -> None:
    """One side of each slot is counted both ways, and a wheel that rolls out is still counted."""
    rover = bench()
    for turn in range(4):
        rover.run(1.0 + 0.07 * turn, (speed, 0.0))
        rover.run(rest)
        rover.run(1.0 + 0.05 * turn, (-speed, 0.0))
        rover.run(rest)
    rover.run(1.0)
    assert apart(rover) == pytest.approx([0.0, 0.0], abs=0.51)


def test_a_standing_wheel_counts_nothing(bench: Benches) -> None:
    rover = bench()
    rover.run(1.0, (0.2, 0.0))
    rover.run(1.0)
    stood = rover.ticks("lwheel")[-1]
    rover.run(5.0)
    assert rover.ticks("lwheel")[-1] == stood


class Square(NamedTuple):
    """How one is driven, m/s and rad/s, and by which left motor."""

    speed: float
    turn: float
    left: Motor
    stop: Literal["brake", "coast"]

    def __str__(self) -> str:
        motors = "a weak left motor" if self.left is WEAK else "equal motors"
        return f"{self.speed} m/s, {motors}, {self.stop}"


@pytest.mark.parametrize(
    "square",
    [
        Square(0.35, 1.2, LEFT, "brake"),
        Square(0.35, 1.2, WEAK, "coast"),
        Square(0.5, 2.0, LEFT, "coast"),
        Square(0.5, 2.0, WEAK, "brake"),
    ],
    ids=str,
)
@pytest.mark.slow
def test_the_last_corner_of_a_square_is_where_odometry_has_it(
    boards: Callable[..., SimulatedBoard],
    build_firmware: Callable[[FirmwareSettings], Built],
    note: Callable[[str, str, str], None],
    square: Square,
) -> None:
    """Odometry from the pulses alone, after a square of 2 m whose corners are stops."""
    firmware = build_firmware(FirmwareSettings(completed(Firmware(stop=square.stop))))
    rover = Bench(boards(firmware.hex, left=square.left)).negotiated()
    for _ in range(4):
        start = rover.board.state
        while math.dist((rover.board.state.x, rover.board.state.y), (start.x, start.y)) < 2.0:
            rover.run(0.1, (square.speed, 0.0))
        rover.run(1.5)
        while rover.board.state.theta < start.theta + math.radians(80):
            rover.run(0.1, (0.0, square.turn))
        rover.run(1.5)
    state, (x, y, theta) = rover.board.state, rover.odometry()
    off, astray = math.dist((state.x, state.y), (x, y)), theta - state.theta
    how = f"{100 * off / state.distance:.1f} % of {state.distance:.1f} m, {math.degrees(astray):+.1f}°"
    note(f"odometry at a square's last corner: {square}", how, "<= 1 %, 4.5°")
    assert state.distance == pytest.approx(8.5, abs=1.5)
    assert off <= 0.01 * state.distance
    assert abs(astray) <= TICK, "half a tick of each wheel, however often it has turned"


def test_a_board_that_stands_costs_little(boards: Callable[..., SimulatedBoard]) -> None:
    """A lab runs it in real time, beside much else."""
    board = boards()
    board.power_cycle()
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    board.run_for(2.0)
    board.close()
    references = (resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before) / reference()
    assert references <= 40
