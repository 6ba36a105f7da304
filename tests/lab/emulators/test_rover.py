"""The Arduino rover: rosserial byte for byte, its clock, its dead-man, and frames that are wrong."""

from __future__ import annotations

import math
import struct
import time
from random import Random

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.lab.emulators import Robot, emulator
from swarmctl.lab.emulators.rosserial_device import Parser, Topic, frame, log, topic_info
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.serial_robot import Port
from tests.timing import PATIENCE

TOPICS = bytes.fromhex("ff fe 00 00 ff 00 00 ff")
TX_STOP = bytes.fromhex("ff fe 00 00 ff 0b 00 f4")
TIME_REQUEST = bytes.fromhex("ff fe 08 00 f7 0a 00 00 00 00 00 00 00 00 00 f5")
TIME_REPLY = bytes.fromhex("ff fe 08 00 f7 0a 00 00 f1 53 65 00 65 cd 1d fd")
TWIST = bytes.fromhex(
    "ff fe 30 00 cf 64 00 9a 99 99 99 99 99 c9 3f" + 32 * " 00" + " 00 00 00 00 00 00 e0 bf 5d"
)
INT32, TWIST_MD5 = "da5909fbe378aeaf85e547e830cc1bb7", "9f195f881246fdfa2798d1d3eebca84a"


def split(data: bytes) -> list[bytes]:
    """Frames of a device, apart."""
    frames = []
    while data:
        size = 8 + int.from_bytes(data[2:4], "little")
        frames.append(data[:size])
        data = data[size:]
    return frames


def number(data: bytes) -> int:
    return int.from_bytes(data[5:7], "little")


def connected(**settings: object) -> Robot:
    rover = emulator("arduino-rover", **settings)
    rover.receive(TOPICS)
    return rover


def test_frames_are_those_of_the_real_client() -> None:
    lwheel = topic_info(0, 125, Topic("lwheel", "std_msgs/Int32", INT32), 280)
    assert lwheel[:7] == bytes.fromhex("ff fe 46 00 b9 00 00")
    assert lwheel[7:19] == bytes.fromhex("7d 00 06 00 00 00") + b"lwheel"
    assert lwheel[-5:] == bytes.fromhex("18 01 00 00 35")
    assert topic_info(0, 126, Topic("rwheel", "std_msgs/Int32", INT32), 280)[-1] == 0x2E
    assert topic_info(1, 100, Topic("cmd_vel", "geometry_msgs/Twist", TWIST_MD5), 280)[-1] == 0x69
    assert frame(125, struct.pack("<i", 1234)) == bytes.fromhex("ff fe 04 00 fb 7d 00 d2 04 00 00 ac")
    assert frame(126, struct.pack("<i", -1)) == bytes.fromhex("ff fe 04 00 fb 7e 00 ff ff ff ff 85")
    assert log("hello") == bytes.fromhex("ff fe 0a 00 f5 07 00 01 05 00 00 00 68 65 6c 6c 6f de")
    assert frame(11) == TX_STOP


def test_it_sends_nothing_before_a_topic_request() -> None:
    rover = emulator("arduino-rover")
    assert rover.run_for(60.0) == []
    assert rover.receive(TIME_REPLY + TWIST) == b""


def test_it_requests_time_then_announces_its_topics() -> None:
    answers = split(emulator("arduino-rover").receive(TOPICS))
    assert answers == [
        TIME_REQUEST,
        topic_info(0, 104, Topic("lwheel", "std_msgs/Int32", INT32), 128),
        topic_info(0, 105, Topic("rwheel", "std_msgs/Int32", INT32), 128),
        topic_info(1, 100, Topic("cmd_vel", "geometry_msgs/Twist", TWIST_MD5), 128),
    ]


def test_it_may_report_its_firmware_in_a_log_message() -> None:
    answers = split(emulator("arduino-rover", firmware="0f1e2d").receive(TOPICS))
    assert answers[-1] == log("swarmctl firmware 0f1e2d")


def test_both_wheels_are_published_twenty_times_a_second() -> None:
    rover = connected()
    rover.receive(TWIST)
    sent = rover.run_for(0.31)
    assert [number(one) for one in sent] == [104, 105] * 6
    rover.receive(TIME_REPLY)
    assert len(rover.run_for(1.0)) == 40


def test_a_twist_turns_the_wheels_as_in_rep_103() -> None:
    rover = connected()
    rover.receive(TWIST)  # 0.2 m/s, -0.5 rad/s
    assert (rover.state.v, rover.state.omega) == pytest.approx((0.2, -0.5))
    assert rover.state.last_command == "cmd_vel 0.2 -0.5"


def test_ticks_count_in_the_commanded_direction() -> None:
    rover = connected()
    for _ in range(10):
        rover.receive(frame(100, struct.pack("<6d", -0.2, 0, 0, 0, 0, 0)))
        rover.run_for(0.1)
    left, right = rover.run_for(0.06)[-2:]
    assert struct.unpack("<i", left[7:-1]) == struct.unpack("<i", right[7:-1]) == (-21,)  # 97.9 a metre


@given(*[st.floats(allow_nan=True, allow_infinity=True)] * 2)
def test_any_twist_is_limited_and_keeps_its_arc(v: float, omega: float) -> None:
    rover = connected(top_speed=0.5)
    rover.receive(frame(100, struct.pack("<6d", v, 0, 0, 0, 0, omega)))
    state = rover.state
    assert max(abs(state.left), abs(state.right)) <= 0.5 + 1e-9
    if math.isfinite(v) and math.isfinite(omega) and max(abs(v), abs(omega)) < 1e3:
        assert state.v * omega == pytest.approx(v * state.omega, rel=1e-6, abs=1e-9)


def test_without_commands_for_0_4_s_the_wheels_stand() -> None:
    rover = connected()
    rover.receive(TWIST)
    rover.run_for(5.0)
    assert rover.state.v == 0.0
    assert rover.state.distance == pytest.approx(0.4 * 0.2)


def test_it_requests_time_every_2_5_s_and_gives_up_after_11_s() -> None:
    rover = connected()
    requests, ticks = [], []
    for tenth in range(200):
        for one in rover.run_for(0.1):
            (requests if one == TIME_REQUEST else ticks).append(tenth / 10)
    assert requests == pytest.approx([2.5, 5.0, 7.5, 10.0], abs=0.11)
    assert max(ticks) == pytest.approx(11.0, abs=0.11)
    assert split(rover.receive(TOPICS))[0] == TIME_REQUEST


def test_time_replies_keep_it_connected() -> None:
    rover = connected()
    for _ in range(30):
        rover.receive(TIME_REPLY)
        assert rover.run_for(1.0)


def test_tx_stop_stops_publishing() -> None:
    rover = connected()
    rover.receive(TX_STOP)
    assert rover.run_for(10.0) == []


# What it does with frames that are wrong


def test_an_ff_before_a_frame_loses_that_frame() -> None:
    rover = emulator("arduino-rover")
    assert set(split(rover.receive(b"\xff" + TOPICS))) == {TIME_REQUEST}  # what a wrong version is answered
    rover.run_for(0.03)  # the last byte of the frame that was lost began another one
    assert len(split(rover.receive(TOPICS))) == 4


def test_a_wrong_version_requests_time_only_while_disconnected() -> None:
    old = bytes.fromhex("ff ff 00 00 00 00 ff")
    assert emulator("arduino-rover").receive(old[:2]) == TIME_REQUEST
    assert connected().receive(old[:2]) == b""


@pytest.mark.parametrize("at", [4, -1])
def test_a_wrong_checksum_drops_the_frame(at: int) -> None:
    rover = connected()
    wrong = bytearray(TWIST)
    wrong[at] ^= 1
    assert rover.receive(bytes(wrong)) == b""
    assert rover.state.v == 0.0
    rover.receive(bytes(64) + TWIST)
    assert rover.state.v == pytest.approx(0.2)


def test_a_frame_must_arrive_within_20_ms() -> None:
    rover = connected()
    rover.receive(TWIST[:20])
    rover.run_for(0.015)
    rover.receive(TWIST[20:])
    assert rover.state.v > 0
    rover = connected()
    rover.receive(TWIST[:20])
    rover.run_for(0.025)
    rover.receive(TWIST[20:])
    assert rover.state.v == 0.0


def test_a_frame_longer_than_its_buffer_resets_the_board() -> None:
    rover = connected()
    rover.receive(TWIST)
    rover.receive(frame(100, bytes(200)))
    assert rover.state.v == 0.0
    assert rover.receive(TOPICS) == b""  # the bootloader
    rover.run_for(1.5)
    assert len(split(rover.receive(TOPICS))) == 4


@given(st.binary(max_size=200))
def test_the_parser_recovers_after_a_pause(data: bytes) -> None:
    parser = Parser(128)
    for byte in data:
        parser.push(byte, 0.0)
    found = [parser.push(byte, 1.0) for byte in TWIST]
    assert found[-1] is not None
    assert not any(found[:-1])


# What it may do wrong itself


@pytest.mark.parametrize(
    ("faults", "wrong"),
    [
        (Faults(stray_ff=1.0), b"\xff" + TIME_REQUEST),
        (Faults(bad_length=1.0), TIME_REQUEST[:4] + b"\x08" + TIME_REQUEST[5:]),
        (Faults(bad_checksum=1.0), TIME_REQUEST[:-1] + b"\x0a"),
        (Faults(overlong=1.0), frame(10, bytes(8 + 1024))),
        (Faults(no_time=True), b""),
        (Faults(wrong_md5=True), TIME_REQUEST),
    ],
)
def test_a_time_request_may_be_wrong(faults: Faults, wrong: bytes) -> None:
    assert emulator("arduino-rover").corrupt(TIME_REQUEST, faults, Random(0)) == wrong


def test_the_md5_fault_changes_nothing_else() -> None:
    rover = emulator("arduino-rover")
    announcement = split(rover.receive(TOPICS))[1]
    corrupt = rover.corrupt(announcement, Faults(wrong_md5=True), Random(0))
    assert corrupt[:-37] == announcement[:-37]
    assert INT32.encode() not in corrupt
    assert corrupt == frame(0, corrupt[7:-1])


def test_opening_its_port_resets_it_into_the_boot_loader() -> None:
    began = time.monotonic()
    with Port(connected()) as port, serial.Serial(str(port.path), 57600, timeout=0.2) as host:
        while not (received := host.read(8)) and time.monotonic() < began + PATIENCE:
            host.write(TOPICS)
        assert time.monotonic() - began >= 1.4
        assert received == TIME_REQUEST[:8]
        host.timeout = PATIENCE
        pulses = frame(104, bytes(4))
        assert host.read_until(pulses).endswith(pulses)


def test_without_dtr_it_answers_at_once() -> None:
    with (
        Port(emulator("arduino-rover", dtr=False)) as port,
        serial.Serial(str(port.path), timeout=PATIENCE) as host,
    ):
        host.write(TOPICS)
        assert host.read(16) == TIME_REQUEST
