"""The board can compute with every allowed setting of its sketch; larger values are refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.analysis.rosserial_load import PATIENCE
from swarmctl.analysis.sketch_limits import PULSES_PER_SECOND, most_pulses, patience, wrong_baud
from swarmctl.firmware.compiler import Built
from swarmctl.lab.emulators.arduino_rover import SimulatedBoard
from swarmctl.lab.emulators.uno import LEFT, RIGHT
from swarmctl.render.sketch import FirmwareSettings
from swarmctl.robot_types.sketch_settings import SKETCH_BOUNDS, Firmware, WheelDrive, completed
from tests.firmware.firmware_bench import RADIUS, Bench

UINT16, UINT32 = 2**16, 2**32


def bounds(model: type[Firmware | WheelDrive], key: str) -> tuple[float, float]:
    """What the model allows, according to its schema."""
    allowed = model.model_json_schema()["properties"][key]["anyOf"][0]
    return allowed["minimum"], allowed["maximum"]


def within(model: type[Firmware | WheelDrive], key: str) -> st.SearchStrategy[float]:
    return st.floats(*bounds(model, key), allow_subnormal=False)


def extreme(end: int) -> FirmwareSettings:
    """Every number at its least (0) or its most (1), and the robot's shape as bad as that can be."""
    wheel = WheelDrive.model_validate(
        {key: bounds(WheelDrive, key)[end] for key in ("pwm_min", "full_speed")}
    )
    chosen: dict[str, Any] = {
        key: bounds(Firmware, key)[end] for key in ("acceleration_max", "control_period", "kp", "ki")
    }
    speed, radius = SKETCH_BOUNDS["wheel_speed_max"][end], SKETCH_BOUNDS["wheel_radius"][1 - end]
    pulses = 1 if end == 0 else max(1, min(2000, most_pulses(speed, radius)))
    firmware = completed(Firmware(left=wheel, right=wheel, pulses_per_turn=pulses, **chosen))
    return FirmwareSettings(
        firmware,
        baud=(19200, 1_000_000)[end],
        ticks_rate=(1.0, 100.0)[end],
        wheel_radius=radius,
        wheel_speed_max=speed,
        dead_man=(0.05, 2.0)[end],
    )


@pytest.mark.parametrize("end", [0, 1])
def test_what_is_allowed_compiles(build_firmware: Callable[[FirmwareSettings], Built], end: int) -> None:
    """The compiler works out most of it, and refuses what does not fit into its type."""
    assert build_firmware(extreme(end)).hex.exists()


@given(
    pwm_min=within(WheelDrive, "pwm_min"),
    full_speed=within(WheelDrive, "full_speed"),
    acceleration=within(Firmware, "acceleration_max"),
    period=within(Firmware, "control_period"),
    pulses=st.integers(*map(int, bounds(Firmware, "pulses_per_turn"))),
    speed=st.floats(*SKETCH_BOUNDS["wheel_speed_max"]),
    radius=st.floats(*SKETCH_BOUNDS["wheel_radius"]),
)
def test_nothing_overflows(
    *,
    pwm_min: float,
    full_speed: float,
    acceleration: float,
    period: float,
    pulses: int,
    speed: float,
    radius: float,
) -> None:
    """The sketch's own expressions, in the types that it has for them."""
    assert 0 < (255 - pwm_min) * radius / full_speed < 1e6, "PWM for each rad/s"
    assert 1e-6 < acceleration * period / radius < 1e6, "rad/s in a step of the loop"
    assert 1e6 * (math.tau / pulses) * radius / (4 * speed) < UINT32, "us between ticks that are noise"
    if pulses <= most_pulses(speed, radius):
        assert 4 * PULSES_PER_SECOND * period < UINT16, "ticks in a step of the loop"
    assert round(1000 * period) >= 1, "ms"


@pytest.mark.parametrize("baud", [19200, 115200, 1_000_000])
def test_commands_pass_at_the_slowest_and_at_the_fastest_line(
    boards: Callable[..., SimulatedBoard], build_firmware: Callable[[FirmwareSettings], Built], baud: int
) -> None:
    """At 19200 baud a command takes 29 ms: beyond the 20 ms that other sketches wait for it."""
    assert not wrong_baud(baud, 0.4)
    assert patience(baud) >= max(PATIENCE, 560 / baud)
    firmware = build_firmware(FirmwareSettings(baud=baud))
    rover = Bench(boards(firmware.hex, baud=baud))
    rover.run(5.0)  # to announce its topics takes a while
    for _ in range(25):  # sent again every 0.2 s, as by the driver
        rover.run(0.1, (0.2, 0.0))
        rover.run(0.1)
    assert rover.speeds == (pytest.approx(0.2, rel=0.1), pytest.approx(0.2, rel=0.1))


def test_as_many_pulses_as_are_allowed_are_counted(
    boards: Callable[..., SimulatedBoard], build_firmware: Callable[[FirmwareSettings], Built]
) -> None:
    pulses = most_pulses(0.5, RADIUS)
    firmware = build_firmware(FirmwareSettings(completed(Firmware(pulses_per_turn=pulses))))
    left, right = replace(LEFT, pulses=pulses), replace(RIGHT, pulses=pulses)
    rover = Bench(boards(firmware.hex, left=left, right=right)).negotiated()
    rover.run(3.0, (0.5, 0.0))
    rover.run(1.0)
    for topic, angle in zip(("lwheel", "rwheel"), rover.board.truth.angles, strict=True):
        assert rover.ticks(topic)[-1] == pytest.approx(angle / math.tau * pulses, abs=2)


@pytest.mark.parametrize(
    ("baud", "trouble"),
    [
        (9600, "a command takes 58 ms"),
        (230_400, "an UNO can only make 222222"),
        (2_000_000, "cannot receive bytes at 2000000 baud"),
    ],
)
def test_a_line_that_the_board_does_not_bear_is_refused(baud: int, trouble: str) -> None:
    assert trouble in wrong_baud(baud, 0.4)
