"""The e-puck, byte for byte: text, binary, and the border between them."""

from __future__ import annotations

import struct

import pytest

from swarmctl.lab.emulators import emulator

ERROR = b"z,Command not found\r\n"
BANNER = (
    b"Selector pos 3\r\n\x0c\x07WELCOME to the SerCom protocol on e-Puck\r\n"
    b'the EPFL education robot type "H" for help\r\n'
)


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        (b"A\r", b"a,0,-2,16387\r\n"),
        (b"B,1\r", b"b\r\n"),
        (b"b\r", b"b,2462 (80%)\r\n"),
        (b"C\r", b"c,3\r\n"),
        (b"D,500,-500\r", b"d\r\n"),
        (b"E\n", b"e,0,0\r\n"),
        (b"F,1\r", b"f\r\n"),
        (b"G\r", b"g IR check : 0x0, address : 0x0, data : 0x0\r\n"),
        (b"g\r", b"g,0,-2,3\r\n"),
        (b"I\r", b"i,1,40,40,8,3200\r\n"),
        (b"J,0,20,20,4\r", b"j\r\n"),
        (
            b"K\r",
            b"k, Starting calibration - Remove any object in sensors range\r\nk, Calibration finished\r\n",
        ),
        (b"L,3,1\r", b"l\r\n"),
        (b"M\r", b"m,903,901,906,904,902\r\n"),
        (b"N\r", b"n,7,5,10,8,6,4,9,7\r\n"),
        (b"O\r", b"o,3703,3701,3706,3704,3702,3700,3705,3703\r\n"),
        (b"P,5,-5\r", b"p\r\n"),
        (b"Q\r", b"q,0,0\r\n"),
        (b"R\r", b"r\r\n" + BANNER),
        (b"S\r", b"s\r\n"),
        (b"T,1\r", b"t\r\n"),
        (b"t\r", b"t\r\n"),
        (b"U\r", b"u,17,15,20\r\n"),
        (b"V\r", b"v,Version 1.2.2 August 2008 GCtronic\r\nHW version: FFFF\r\n"),
        (b"W,1,2,3\r", b"w\r\n"),
        (b"Y,1,2\r", b"y,1,2\r\ny,23\r\n"),
        (b"d,1,2\r", b"d\r\n"),
        (b"nonsense\r", b"n,7,5,10,8,6,4,9,7\r\n"),
        (b"D\r", b"d\r\n"),
        (b"X\r", ERROR),
        (b"?\r", ERROR),
        (b"\x00\x00\x00E\r", b"e,0,0\r\n"),
        (b"\r\n\n\rE\r", b"e,0,0\r\n"),
        (b"\r\x00E\r", ERROR),
    ],
)
def test_every_text_has_its_reply(request_: bytes, reply: bytes) -> None:
    assert emulator("epuck").receive(request_) == reply


def test_it_prints_a_banner_when_switched_on() -> None:
    assert emulator("epuck").banner() == BANNER


def test_e_echoes_the_command_and_the_wheels_are_limited() -> None:
    epuck = emulator("epuck")
    assert epuck.receive(b"D,3000,-2000\rE\r") == b"d\r\ne,3000,-2000\r\n"
    assert (epuck.state.left, epuck.state.right) == pytest.approx((0.1288, -0.1288), abs=1e-4)


@pytest.mark.parametrize(
    ("request_", "speeds"),
    [
        (b"D,7\r", b"e,7,200\r\n"),
        (b"D\r", b"e,100,200\r\n"),
        (b"D,,9\r", b"e,100,200\r\n"),
        (b"D,x,9\r", b"e,100,200\r\n"),
    ],
)
def test_missing_parameters_keep_their_value_and_are_acknowledged(request_: bytes, speeds: bytes) -> None:
    epuck = emulator("epuck")
    epuck.receive(b"D,100,200\r")
    assert epuck.receive(request_) == b"d\r\n"
    assert epuck.receive(b"E\r") == speeds


def test_numbers_have_16_bits() -> None:
    assert emulator("epuck").receive(b"D,65535,32768\rE\r") == b"d\r\ne,-1,-32768\r\n"


def test_s_stops_the_wheels_and_leaves_the_echo() -> None:
    epuck = emulator("epuck")
    assert epuck.receive(b"D,100,200\rS\rE\r") == b"d\r\ns\r\ne,100,200\r\n"
    assert (epuck.state.left, epuck.state.right) == (0.0, 0.0)


def test_r_resets_everything_and_stops() -> None:
    epuck = emulator("epuck")
    epuck.receive(b"D,100,200\r")
    epuck.advance(1.0)
    x = epuck.state.x
    epuck.receive(b"R\r")
    epuck.advance(1.0)
    assert epuck.receive(b"E\rQ\r") == b"e,0,0\r\nq,0,0\r\n"
    assert epuck.state.x == x


def test_step_counters_wrap_at_16_bits() -> None:
    epuck = emulator("epuck")
    epuck.receive(b"D,1000,-1000\r")
    epuck.advance(32.768)
    assert epuck.receive(b"Q\r") == b"q,-32768,-32768\r\n"
    epuck.advance(0.001)
    assert epuck.receive(b"Q\r") == b"q,-32767,32767\r\n"


@pytest.mark.parametrize("rest", [b"", b"\xbc\xf4\x01\x0c\xfe\x00"])
def test_a_second_terminator_turns_binary_into_text(rest: bytes) -> None:
    epuck = emulator("epuck")
    assert epuck.receive(b"D,1,1\r\n") == b"d\r\n"
    assert epuck.receive(b"\xbb\x00" + rest) == b""
    assert epuck.receive(b"\r") == ERROR
    assert epuck.receive(b"\xbb\x00") == b"\x01\x00\x01\x00"


def test_binary_speeds_are_set_without_a_reply() -> None:
    epuck = emulator("epuck")
    assert epuck.receive(bytes.fromhex("bc f4 01 0c fe 00")) == b""
    assert epuck.receive(bytes.fromhex("bb 00")) == struct.pack("<2h", 500, -500)
    assert epuck.receive(b"E\r") == b"e,500,-500\r\n"


def test_binary_readings_chain_and_come_after_the_zero() -> None:
    epuck = emulator("epuck")
    epuck.receive(b"D,300,-300\r")
    epuck.advance(1.0)
    assert epuck.receive(bytes.fromhex("9f bb b2 af 8b")) == b""
    answer = epuck.receive(b"\x00")
    assert len(answer) == 36
    assert struct.unpack("<2h", answer[6:10]) == (300, -300)
    assert struct.unpack("<2h", answer[26:30]) == (300, -300)


@pytest.mark.parametrize(
    ("letter", "size"),
    [
        ("a", 6), ("A", 12), ("b", 2), ("E", 4), ("g", 6), ("I", 3203), ("M", 10), ("N", 16), ("O", 16),
        ("Q", 4), ("t", 1), ("u", 6), ("U", 601), ("Z", 0), ("x", 0),
    ],
)  # fmt: skip
def test_binary_answers_have_their_size(letter: str, size: int) -> None:
    assert len(emulator("epuck").receive(bytes([-ord(letter) & 0xFF, 0]))) == size


def test_the_sound_buffer_comes_at_once() -> None:
    epuck = emulator("epuck")
    assert len(epuck.receive(bytes([-ord("U") & 0xFF]))) == 600
    assert len(epuck.receive(b"\x00")) == 1


@pytest.mark.parametrize(("letter", "payload"), [("D", 4), ("L", 2), ("P", 4), ("W", 3)])
def test_zeros_in_a_payload_do_not_end_a_request(letter: str, payload: int) -> None:
    request = bytes([-ord(letter) & 0xFF]) + bytes(payload) + b"\xbb"
    assert emulator("epuck").receive(request + b"\x00") == bytes(4)
