"""The classic Koala, byte for byte."""

from __future__ import annotations

import pytest

from swarmctl.lab.emulators import emulator
from swarmctl.lab.emulators.differential_drive import Wall

ERROR = b"z,Protocol error\r\n"


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        (b"A,3800,800,100\n", b"a\r\n"),
        (b"B\n", b"b,5.00,1.00\r\n"),
        (b"C,0,0\n", b"c\r\n"),
        (b"D,44,44\n", b"d\r\n"),
        (b"D,-100,100\r", b"d\r\n"),
        (b"E\n", b"e,0,0\r\n"),
        (b"F,3000,20,4000\n", b"f\r\n"),
        (b"G,0,0\n", b"g\r\n"),
        (b"H\n", b"h,0,0\r\n"),
        (b"I,0\n", b"i,515\r\n"),
        (b"J,20,64,20,64\n", b"j\r\n"),
        (b"K\n", b"k,1,1,0,1,1,0\r\n"),
        (b"L,0,1\n", b"l\r\n"),
        (b"M,0\n", b"m,633\r\n"),
        (b"M,3\n", b"m,24\r\n"),
        (b"N\n", b"n,15,13,18,16,14,12,17,15,13,18,16,14,12,17,15,13\r\n"),
        (b"O\n", b"o,703,701,706,704,702,700,705,703,701,706,704,702,700,705,703,701\r\n"),
        (b"P,0,0\n", b"p\r\n"),
        (b"R,4\n", b"r,255\r\n"),
        (b"W,1,4\n", b"w\r\n"),
        (b"T,1,2\n", ERROR),
        (b"\r\n\n\rE\r\n", b"e,0,0\r\n"),
        (b"D,44\n", ERROR),
        (b"D,44,44,44\n", ERROR),
        (b"D,44,x\n", ERROR),
        (b"D,,\n", ERROR),
        (b"D, 44,44\n", ERROR),
        (b"D,4.4,44\n", ERROR),
        (b"d,44,44\n", ERROR),
        (b"E,1\n", ERROR),
        (b"L,2,1\n", ERROR),
        (b"M,6\n", ERROR),
        (b"Z\n", ERROR),
        (b"\xff\x00\n", ERROR),
    ],
)
def test_every_request_has_its_reply(request_: bytes, reply: bytes) -> None:
    assert emulator("koala").receive(request_) == reply


def test_speed_is_in_units_of_4_5_mm_per_second() -> None:
    koala = emulator("koala")
    assert koala.receive(b"D,44,-6\nE\n") == b"d\r\ne,44,-6\r\n"
    assert koala.state.left == pytest.approx(0.198)
    assert koala.state.right == pytest.approx(-0.027)


def test_the_motors_have_a_top_speed() -> None:
    assert emulator("koala").receive(b"D,500,-1000\nE\n") == b"d\r\ne,127,-127\r\n"


def test_a_pulse_is_0_045_mm() -> None:
    koala = emulator("koala")
    koala.receive(b"D,100,-50\n")
    koala.advance(1.0)
    assert koala.receive(b"H\nG,7,-8\nH\n") == b"h,10000,-5000\r\ng\r\nh,7,-8\r\n"


def test_position_counters_have_32_bits() -> None:
    koala = emulator("koala")
    koala.receive(b"G,2147483647,-2147483648\nD,1,-1\n")
    koala.advance(0.01)
    assert koala.receive(b"H\n") == b"h,-2147483648,2147483647\r\n"


def test_it_drives_to_a_position_and_stays_there() -> None:
    koala = emulator("koala")
    koala.receive(b"J,40,64,20,64\nG,0,0\nC,2000,-2000\n")
    assert koala.receive(b"K\n") == b"k,0,0,0,0,0,0\r\n"
    koala.advance(0.75)  # the left wheel is there after 0.5 s, the right one after 1 s
    assert koala.receive(b"H\nK\n") == b"h,2000,-1500\r\nk,1,0,0,0,0,0\r\n"
    koala.advance(60.0)
    assert koala.receive(b"H\nE\nK\n") == b"h,2000,-2000\r\ne,0,0\r\nk,1,0,0,1,0,0\r\n"


def test_it_detects_a_wall_ahead() -> None:
    koala = emulator("koala", walls=[Wall(1.0, -2.0, 1.0, 2.0)])

    def ahead() -> int:
        return int(koala.receive(b"N\n").split(b",")[1])

    far = ahead()
    koala.receive(b"D,100,100\n")
    koala.advance(1.7)
    near = ahead()
    assert far < 30
    assert 300 < near <= 1023


def test_a_turning_motor_draws_more_current() -> None:
    standing, driving = emulator("koala"), emulator("koala")
    driving.receive(b"D,100,100\n")
    assert int(driving.receive(b"M,3\n")[2:]) > int(standing.receive(b"M,3\n")[2:])


def test_lights_are_in_the_state_and_go_off_with_it() -> None:
    koala = emulator("koala")
    koala.receive(b"L,0,1\nL,1,2\n")
    assert koala.state.lights == {"led0": 1, "led1": 1}
    koala.receive(b"L,1,2\n")
    assert koala.state.lights == {"led0": 1, "led1": 0}
    koala.power_cycle()
    assert koala.state.lights == {"led0": 0, "led1": 0}


def test_the_battery_has_the_set_level() -> None:
    empty, full = (int(emulator("koala", battery=level).receive(b"M,0\n")[2:]) for level in (0.0, 1.0))
    assert 0.020 * empty == pytest.approx(11.0, abs=0.2)
    assert 0.020 * full == pytest.approx(13.0, abs=0.2)
