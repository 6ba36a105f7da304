"""The Khepera III, byte for byte, with the traps of its server."""

from __future__ import annotations

import struct

import pytest

from swarmctl.lab.emulators import emulator

ERROR = b"$\r\n"


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        (b"A,2\n", b"a\r\n"),
        (b"B\n", b"b,2,1\r\n"),
        (b"C,0,d31\n", b"c\r\n"),
        (b"D,l14401,l14401\n", b"d\r\n"),
        (b"E\r", b"e,0,0\r\n"),
        (b"F,l0,l0\n", b"f\r\n"),
        (b"G,3\n", b"g,1,241,117,0" + b",0" * 12 + b",9\r\n"),
        (b"G,1\n", b"g,0" + b",0" * 15 + b",6\r\n"),
        (b"H,d0,d620,d3,d10\n", b"h\r\n"),
        (b"I,l0,l0\n", b"i\r\n"),
        (b"J,l15000,l10\n", b"j\r\n"),
        (b"K,0,1\n", b"k\r\n"),
        (b"L,l0,l0\n", b"l\r\n"),
        (b"M\n", b"m\r\n"),
        (b"N\n", b"n,43,41,46,44,42,40,45,43,41,3106,3104,0\r\n"),
        (b"O\n", b"o,2803,2801,2806,2804,2802,2800,2805,2803,2801,2806,2804,0\r\n"),
        (b"P,l0,l0\n", b"p\r\n"),
        (b"R\n", b"r,0,0\r\n"),
        (b"V,0\n", b"v,8,3\r\n"),
        (b"V,1\n", b"v,-313,5000\r\n"),
        (b"V,5\n", b"v,80\r\n"),
        (b"Z\n", b"z\r\n"),
        (b"\r\n\n\rE\r\n", b"e,0,0\r\n"),
        (b"V,6\n", ERROR),
        (b"V\n", ERROR),
        (b"A,3\n", ERROR),
        (b"D,l100\n", ERROR),
        (b"D,l100000000,l0\n", ERROR),
        (b"d,l1,l1\n", ERROR),
        (b"Q\n", ERROR),
        (b"\xff\n", ERROR),
    ],
)
def test_every_request_has_its_reply(request_: bytes, reply: bytes) -> None:
    assert emulator("khepera3").receive(request_) == reply


@pytest.mark.parametrize(
    ("firmware", "units", "revision"), [(2, 14401, b"b,2,1\r\n"), (3, 21872, b"b,3,0\r\n")]
)
def test_each_firmware_has_its_scale(firmware: int, units: int, revision: bytes) -> None:
    robot = emulator("khepera3", firmware=firmware)
    assert robot.receive(b"B\n") == revision
    assert robot.receive(b"D,l%d,l%d\n" % (units, units)) == b"d\r\n"
    assert robot.receive(b"E\n") == b"e,%d,%d\r\n" % (units, units)
    assert robot.state.v == pytest.approx(0.1, abs=1e-5)


@pytest.mark.parametrize(("firmware", "counts"), [(2, 2146), (3, 3259)])
def test_each_firmware_has_its_encoders(firmware: int, counts: int) -> None:
    robot = emulator("khepera3", firmware=firmware)
    robot.receive(b"D,l%d,l0\n" % round(0.1 * robot.firmware.units_per_metre_per_second))
    robot.advance(1.0)
    assert robot.receive(b"R\n") == b"r,%d,0\r\n" % counts


@pytest.mark.parametrize(
    ("arguments", "left", "right"),
    [
        (b"l-5000,l5000", -5000, 5000),
        (b"-10000,-20000", 10000, 20000),  # the sign goes with the missing type letter
        (b"14000,100", 4000, 0),
        (b"l5000,,l6000,l1,l1,l1", 5000, 6000),  # empty arguments do not count, surplus ones are ignored
    ],
)
def test_the_first_character_of_a_typed_argument_is_lost(arguments: bytes, left: int, right: int) -> None:
    robot = emulator("khepera3")
    assert robot.receive(b"D," + arguments + b"\n") == b"d\r\n"
    assert robot.receive(b"E\n") == b"e,%d,%d\r\n" % (left, right)


def test_bytes_behind_a_request_are_lost_with_its_answer() -> None:
    robot = emulator("khepera3")
    assert robot.receive(b"D,l5000,l5000\nD,l0,l0\nE\n") == b"d\r\n"
    assert robot.receive(b"E\n") == b"e,5000,5000\r\n"
    assert robot.receive(b"E\nD,l0") == b"e,5000,5000\r\n"
    assert robot.receive(b",l0\n") == ERROR


def test_the_regulator_has_a_highest_and_a_lowest_speed() -> None:
    robot = emulator("khepera3")
    robot.receive(b"D,l90000,l-90000\n")
    assert robot.receive(b"E\n") == b"e,43001,-43001\r\n"
    robot.receive(b"D,l1998,l1999\n")
    assert robot.receive(b"E\n") == b"e,0,1999\r\n"
    robot.receive(b"L,l500,l90000\n")
    assert robot.receive(b"E\n") == b"e,500,47999\r\n"


def test_the_timestamp_counts_milliseconds_since_z() -> None:
    robot = emulator("khepera3")
    robot.advance(1.25)
    assert robot.receive(b"N\n").endswith(b",1250\r\n")
    assert robot.receive(b"Z\n") == b"z\r\n"
    robot.advance(0.5)
    assert robot.receive(b"O\n").endswith(b",500\r\n")


def test_the_binary_block_has_67_bytes() -> None:
    robot = emulator("khepera3")
    robot.receive(b"D,l5000,l-6000\n")
    robot.receive(b"I,l70000,l-1\n")
    block = robot.receive(b"X\n")
    fields = struct.unpack("<c22H4iI2s", block)
    assert (len(block), fields[0], fields[23:27], fields[28]) == (67, b"x", (5000, -6000, 70000, -1), b"\n\r")


def test_only_a_2_ends_the_braitenberg_vehicle() -> None:
    robot = emulator("khepera3")
    robot.receive(b"A,0\n")
    robot.receive(b"D,l0,l0\n")
    assert robot.receive(b"E\n") == b"e,5120,5120\r\n"
    robot.receive(b"A,2\n")
    assert robot.receive(b"E\n") == b"e,0,0\r\n"


def test_ultrasound_needs_its_bit_in_the_mask() -> None:
    robot = emulator("khepera3")
    assert robot.receive(b"G,5\n").startswith(b"g,0,")
    robot.receive(b"C,0,d31\n")
    answer = robot.receive(b"G,5\n")
    assert answer.startswith(b"g,1,")
    assert answer.count(b",") == 17


def test_an_unknown_firmware_is_refused() -> None:
    with pytest.raises(ValueError, match="firmware 2 or 3"):
        emulator("khepera3", firmware=4)


def test_without_the_server_no_request_is_lost() -> None:
    through_server, bare = emulator("khepera3"), emulator("khepera3", server=False)
    assert through_server.receive(b"E\nR\nE\n") == b"e,0,0\r\n"
    assert bare.receive(b"E\nR\nE\n") == b"e,0,0\r\nr,0,0\r\ne,0,0\r\n"


def test_the_server_ignores_the_first_character_of_a_number() -> None:
    through_server, bare = emulator("khepera3"), emulator("khepera3", server=False)
    for robot in (through_server, bare):
        robot.receive(b"D,-9000,-9000\n")
    assert through_server.state.v > 0  # the sign was lost
    assert bare.state.v == 0.0  # 8 bits of it are too slow to turn a wheel
    bare.receive(b"D,l-9000,l-9000\n")
    assert bare.state.v < 0


def test_lights_are_in_the_state() -> None:
    khepera = emulator("khepera3")
    khepera.receive(b"K,0,1\n")
    khepera.receive(b"K,1,2\n")
    assert khepera.state.lights == {"led0": 1, "led1": 1}
    khepera.receive(b"K,1,2\n")
    assert khepera.state.lights == {"led0": 1, "led1": 0}


def test_the_battery_has_the_set_level() -> None:
    assert emulator("khepera3", battery=0.25).receive(b"V,5\n") == b"v,25\r\n"
