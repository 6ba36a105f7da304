"""What stops the rover, with the real firmware on the simulated board."""

from __future__ import annotations

import math
import os
import subprocess
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from swarmctl.firmware.compiler import RAM, Built, Toolchain
from swarmctl.lab.emulators.arduino_rover import SimulatedBoard
from swarmctl.lab.emulators.uno import Fault
from tests.firmware import stack
from tests.firmware.firmware_bench import Bench

Benches = Callable[..., Bench]
DEAD_MAN = 0.4  # s
BOOT = 1.5  # s an UNO's boot loader takes
BRAKING = 0.25  # s, from 0.4 m/s; the motors' own


def at_speed(bench: Benches, v: float = 0.4) -> Bench:
    rover = bench()
    rover.run(1.5, (v, 0.0))
    assert min(rover.speeds) > 0.7 * v
    return rover


def time_to_stand(rover: Bench, seconds: float = 3.0) -> float:
    """Seconds until both wheels stand, while no command is sent."""
    start = rover.board.truth.time
    while any(rover.board.truth.speeds) and rover.board.truth.time - start < seconds:
        rover.run(0.01)
    return rover.board.truth.time - start


def test_it_stops_without_commands(bench: Benches, note: Callable[[str, str, str], None]) -> None:
    rover = at_speed(bench)
    before = rover.board.state.distance
    rover.run(0.01, (0.4, 0.0))
    taken = time_to_stand(rover)
    overrun = rover.board.state.distance - before
    note("the rover's firmware: silence to standing", f"{taken:.2f} s", f"{overrun:.2f} m at 0.4 m/s")
    assert DEAD_MAN <= taken <= DEAD_MAN + BRAKING


@pytest.mark.parametrize(
    "command",
    [
        (math.nan, 0.0),
        (0.0, math.nan),
        (math.inf, 0.0),
        (0.1, -math.inf),
        (1e308, 0.0),
        (0.1, 1e30),
        (1e4, 0.0),
    ],
    ids=str,
)
def test_an_invalid_speed_stops_it_at_once(bench: Benches, command: tuple[float, float]) -> None:
    rover = at_speed(bench)
    rover.run(BRAKING, command)
    assert rover.board.truth.speeds == (0.0, 0.0)


@pytest.mark.parametrize("command", [(1e-308, 5e-324), (-0.0, 0.0), (1e-40, -1e-40)], ids=str)
def test_a_negligible_speed_is_zero(bench: Benches, command: tuple[float, float]) -> None:
    rover = at_speed(bench)
    rover.run(1.0, command)
    assert rover.board.truth.speeds == (0.0, 0.0)


def test_a_program_that_hangs_is_started_anew_and_stands(bench: Benches) -> None:
    rover = at_speed(bench)
    rover.board.crash()
    rover.run(0.6)
    assert rover.board.truth.resets == 1
    assert rover.board.truth.speeds == (0.0, 0.0)
    rover.run(20.0)  # the host notices, asks for the topics anew ...
    rover.run(1.0, (0.2, 0.0))  # ... and drives
    assert min(rover.speeds) > 0.1
    assert rover.board.truth.resets == 1


def test_a_storm_of_pulses_does_not_run_away_with_it(bench: Benches) -> None:
    """A loose encoder wire by a motor: the processor does nothing but count, until the watchdog bites."""
    rover = at_speed(bench)
    rover.board.faults = Fault.LEFT_NOISE
    rover.run(1.5)
    assert rover.board.truth.speeds == (0.0, 0.0)
    rover.board.faults = Fault.NONE
    rover.run(20.0)
    rover.run(1.0, (0.2, 0.0))
    assert min(rover.speeds) > 0.1


@pytest.mark.parametrize("fault", [Fault.LEFT_WIRE_BROKEN, Fault.RIGHT_WIRE_BROKEN, Fault.LEFT_STALLED])
def test_a_wheel_that_gives_no_pulses_stops_both(bench: Benches, fault: Fault) -> None:
    rover = at_speed(bench, 0.2)
    rover.board.faults = fault
    rover.run(1.6, (0.2, 0.0))
    assert rover.board.truth.speeds == (0.0, 0.0)
    assert rover.board.truth.drives == (0, 0)
    side = "left" if fault & 0xF else "right"
    assert f"the {side} wheel is driven and gives no pulses" in rover.logs[-1]
    rover.board.faults = Fault.NONE
    rover.run(1.0, (0.2, 0.0))
    assert rover.board.truth.speeds == (0.0, 0.0), "it stands until it receives a stop"
    rover.run(0.2, (0.0, 0.0))
    rover.run(1.0, (0.2, 0.0))
    assert min(rover.speeds) > 0.1


def test_after_its_reset_it_negotiates_at_once(bench: Benches, note: Callable[[str, str, str], None]) -> None:
    """It prints its version at the start, and nothing more until its topics are requested."""
    rover = bench(boot=BOOT)
    rover.run(1.0, (0.4, 0.0))
    rover.board.power_cycle()
    reset, counted = rover.board.truth.time, len(rover.ticks("lwheel"))
    while len(rover.ticks("lwheel")) == counted:
        rover.run(0.1, (0.4, 0.0))
        assert rover.board.truth.time - reset < 2 * BOOT, "no pulses come"
    taken = rover.board.truth.time - reset
    note(
        "the rover's firmware: reset while driving, until pulses come again", f"{taken:.2f} s", f"{BOOT} boot"
    )
    assert taken <= BOOT + 0.5
    rover.run(1.0, (0.4, 0.0))
    assert min(rover.speeds) > 0.3


def test_the_reset_button_lets_go_of_the_motors(bench: Benches) -> None:
    rover = bench(boot=1.5)
    rover.run(1.5, (0.4, 0.0))
    rover.board.power_cycle()
    rover.run(0.05)
    assert rover.board.truth.drives == (0, 0)
    rover.run(1.4)
    assert rover.board.truth.speeds == (0.0, 0.0)


NOISE = st.one_of(
    st.binary(max_size=200),
    st.lists(st.sampled_from([b"\xff", b"\xfe", b"\x00", b"\x64\x00", b"\x30\x00\xcf", b"\xff\xff"])).map(
        b"".join
    ),
)


def test_no_bytes_wedge_it(boards: Callable[..., SimulatedBoard]) -> None:
    """Whatever came before: it is the same program still, and answers a request for its topics."""
    board = boards()

    @settings(
        max_examples=40 if os.environ.get("CI") else 25,
        suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    )
    @given(NOISE)
    def check(noise: bytes) -> None:
        board.replies(noise)
        board.run_for(0.002 * len(noise) / 10 + 0.05)
        board.replies(bytes.fromhex("ff fe 00 00 ff 00 00 ff"))
        output = b"".join(board.run_for(0.2))
        assert output.count(b"std_msgs/Int32") == 2
        assert board.truth.resets == 0

    check()


def test_the_stack_stays_far_from_the_data(
    bench: Benches, firmware: Built, tools: Toolchain, note: Callable[[str, str, str], None]
) -> None:
    command = [tools.tool("avr-objdump"), "-d", "--no-show-raw-insn", str(firmware.elf)]
    bound = stack.deepest(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    rover = bench()
    rover.run(3.0, (0.2, 0.5))
    rover.board.faults = Fault.LEFT_WIRE_BROKEN
    rover.run(2.0, (0.2, 0.5))
    seen = rover.board.truth.stack
    note("the rover's firmware: RAM, data and deepest stack", f"{firmware.data} + {seen} B", f"of {RAM} B")
    assert seen <= bound <= 1.5 * seen, "the computed stack is a close upper bound"
    assert firmware.data + bound <= RAM / 2
