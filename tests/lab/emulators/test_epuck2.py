"""The e-puck2 where it differs from the e-puck, and what both of them show."""

from __future__ import annotations

import struct

import pytest

from swarmctl.lab.emulators import Wall, emulator

EVERYTHING = struct.Struct("<3h3f3h3fb8H8HH4H2hH5B3H3Hx")


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        (b"A\r", b"a,0,-2,16387\r\n"),
        (b"b\r", b"b,3310 (80%)\r\n"),
        (b"C\r", b"c,3\r\n"),
        (b"N\r", b"n,7,5,10,8,6,4,9,7\r\n"),
        (b"R\r", b""),  # the reset is commented out in the firmware, and so is its reply
        (b"T,1\r", b"t\r\n"),
        (b"U\r", b"u,17,15,20\r\n"),
        (b"V\r", b"v,Version 2.0 January 2018 GCtronic\r\nHW version: FFFF\r\n"),
        (b"X\r", b"z,Command not found\r\n"),
    ],
)
def test_text_has_its_reply(request_: bytes, reply: bytes) -> None:
    assert emulator("epuck2").receive(request_) == reply


def test_speeds_are_limited_to_1100_and_echoed_as_given() -> None:
    robot = emulator("epuck2")
    assert robot.receive(b"D,3000,-1100\rE\r") == b"d\r\ne,3000,-1100\r\n"
    assert (robot.state.left, robot.state.right) == pytest.approx((0.1417, -0.1417), abs=1e-4)


def test_binary_speeds_lose_their_sign_in_the_echo() -> None:
    robot = emulator("epuck2")
    robot.receive(bytes.fromhex("bc f4 01 0c fe 00"))
    assert robot.receive(b"E\r") == b"e,500,65036\r\n"
    assert robot.receive(bytes.fromhex("bb 00")) == struct.pack("<2h", 500, -500)
    assert robot.state.right == pytest.approx(-0.0644, abs=1e-4)


def test_text_counts_steps_past_16_bits_and_binary_wraps_them() -> None:
    robot = emulator("epuck2")
    robot.receive(b"D,1000,-1000\r")
    robot.advance(40.0)
    assert robot.receive(b"Q\r") == b"q,40000,-40000\r\n"
    assert struct.unpack("<2h", robot.receive(b"\xaf\x00")) == (40000 - 65536, 65536 - 40000)


def test_all_sensors_come_in_103_bytes() -> None:
    robot = emulator("epuck2", walls=[Wall(0.035 + 0.4, -1.0, 0.035 + 0.4, 1.0)], selector=8, battery=1.0)
    robot.receive(b"P,7,-8\r")
    answer = robot.receive(b"\xf8\x00")
    assert len(answer) == 103 == EVERYTHING.size
    values = EVERYTHING.unpack(answer)
    assert values[2] == pytest.approx(16384, abs=5)  # up, of the accelerometer
    assert values[9:12] == pytest.approx((22.0, 0.0, -42.0))  # magnetometer
    assert values[12] == 31  # temperature
    assert values[29] == 400  # time of flight, mm
    assert values[34:36] == (7, -8)  # steps
    assert values[36] == 3441  # battery
    assert values[41] == 8  # selector


def test_all_actuators_are_set_at_once() -> None:
    robot = emulator("epuck2")
    colours = bytes(range(1, 13))
    request = struct.pack("<BBhhB", 0xF7, 0, 500, -500, 0b110001) + colours + b"\x04\x00"
    assert len(request) == 1 + 19 + 1
    assert robot.receive(request) == b""
    state = robot.state
    assert (state.left, state.right) == pytest.approx((0.0644, -0.0644), abs=1e-4)
    assert [state.lights[name] for name in ("led0", "led2", "body", "front")] == [1, 0, 1, 1]
    assert [state.lights[f"led7_{colour}"] for colour in ("red", "green", "blue")] == [10, 11, 12]
    assert state.sound == 3
    steps = struct.pack("<BBhhB", 0xF7, 4, 900, -900, 0) + bytes(12) + b"\x20\x00"
    robot.receive(steps)
    assert robot.receive(b"Q\r") == b"q,900,-900\r\n"
    assert robot.state.v == pytest.approx(0.0)
    assert robot.state.sound == 0
    assert not any(robot.state.lights.values())


@pytest.mark.parametrize(
    ("request_", "size"),
    [
        ("f5 00", 1), ("f4 00", 8), ("f3 00", 2), ("f2 00", 1), ("f1 01 00", 1), ("f0 01 00", 1),
        ("ef 01 00", 1), ("f6" + 12 * " 05" + " 00", 0), ("b3 00", 8), ("8c 00", 1), ("ab 00", 0),
    ],
)  # fmt: skip
def test_binary_answers_have_their_size(request_: str, size: int) -> None:
    assert len(emulator("epuck2").receive(bytes.fromhex(request_))) == size


def test_text_switches_the_red_of_a_coloured_light() -> None:
    robot = emulator("epuck2")
    robot.receive(b"L,1,1\rL,0,1\r")
    assert (robot.state.lights["led1_red"], robot.state.lights["led0"]) == (10, 1)
    robot.receive(b"L,1,2\r")
    assert robot.state.lights["led1_red"] == 0


# What both of them show


@pytest.mark.parametrize("name", ["epuck", "epuck2"])
def test_lights_are_in_the_state(name: str) -> None:
    robot = emulator(name)

    def shining() -> set[str]:
        return {light for light, level in robot.state.lights.items() if level}

    robot.receive(b"B,1\rF,1\rL,4,1\r")
    assert shining() == {"body", "front", "led4"}
    robot.receive(b"B,2\r")
    assert shining() == {"front", "led4"}
    robot.receive(b"B\r")  # the action is that of the command before
    assert shining() == {"body", "front", "led4"}
    robot.receive(b"S\r")
    assert shining() == {"body", "front"}
    robot.receive(bytes.fromhex("b4 08 00 b4 09 00 b4 02 01 00"))
    assert shining() == {"led2"}
    robot.receive(b"L,99,1\r")
    assert len(shining()) == 8


@pytest.mark.parametrize("name", ["epuck", "epuck2"])
def test_a_sound_plays_until_another_number(name: str) -> None:
    robot = emulator(name)
    robot.receive(b"T,4\r")
    assert robot.state.sound == 4
    robot.receive(b"T,9\r")
    assert robot.state.sound == 0


def test_another_selector_position_only_prints_its_number() -> None:
    robot = emulator("epuck", selector=5)
    assert robot.banner() == b"Selector pos 5\r\n"
    assert robot.receive(b"V\r\xbb\x00") == b""
    robot.selector = 3
    assert robot.receive(b"V\r") == b""  # it looks at the selector when it starts
    assert b"WELCOME" in robot.power_cycle()
    assert robot.receive(b"C\r") == b"c,3\r\n"


def test_the_second_serial_line_has_ten_proximity_values() -> None:
    assert emulator("epuck", selector=10).receive(b"N\r").count(b",") == 10


def test_an_epuck2_answers_over_usb_too_and_not_elsewhere() -> None:
    assert emulator("epuck2", selector=8).receive(b"C\r") == b"c,8\r\n"
    assert emulator("epuck2", selector=4).receive(b"C\r") == b""


@pytest.mark.parametrize("name", ["epuck", "epuck2"])
def test_the_gyroscope_measures_turning(name: str) -> None:
    robot = emulator(name)
    robot.receive(b"D,-100,100\r")
    unit = {"epuck": 0.00875, "epuck2": 1 / 131}[name]
    turning = int(robot.receive(b"g\r").split(b",")[3]) * unit
    assert turning == pytest.approx(27.85, abs=0.1)  # degrees per second
