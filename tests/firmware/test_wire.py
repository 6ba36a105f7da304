"""What the real firmware sends and receives on its serial line, byte for byte (rosserial, protocol 2)."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest

from swarmctl.lab.emulators.arduino_rover import SimulatedBoard

REQUEST = bytes.fromhex("ff fe 00 00 ff 00 00 ff")
TX_STOP = bytes.fromhex("ff fe 00 00 ff 0b 00 f4")
TIME_REQUEST = bytes.fromhex("ff fe 08 00 f7 0a 00 00 00 00 00 00 00 00 00 f5")
TIME_REPLY = bytes.fromhex("ff fe 08 00 f7 0a 00 00 f1 53 65 00 65 cd 1d fd")
FORWARD = bytes.fromhex(
    "ff fe 30 00 cf 64 00 9a 99 99 99 99 99 c9 3f" + "00" * 32 + "00 00 00 00 00 00 e0 bf 5d"
)

type_md5 = {
    b"std_msgs/Int32": b"da5909fbe378aeaf85e547e830cc1bb7",
    b"geometry_msgs/Twist": b"9f195f881246fdfa2798d1d3eebca84a",
}
Boards = Callable[..., SimulatedBoard]


def framed(topic: int, payload: bytes) -> bytes:
    length, body = struct.pack("<H", len(payload)), struct.pack("<H", topic) + payload
    return b"\xff\xfe" + length + bytes([~sum(length) & 255]) + body + bytes([~sum(body) & 255])


def text(value: bytes) -> bytes:
    return struct.pack("<I", len(value)) + value


def info(role: int, topic: int, name: bytes, kind: bytes, size: int) -> bytes:
    payload = (
        struct.pack("<H", topic) + text(name) + text(kind) + text(type_md5[kind]) + struct.pack("<i", size)
    )
    return framed(role, payload)


def receive(board: SimulatedBoard, seconds: float, data: bytes = b"") -> bytes:
    board.replies(data)
    return b"".join(board.run_for(seconds))


@pytest.fixture
def board(boards: Boards) -> SimulatedBoard:
    """A board whose greeting is over."""
    board = boards()
    receive(board, 0.1)
    return board


@pytest.fixture
def connected(board: SimulatedBoard) -> SimulatedBoard:
    receive(board, 0.3, REQUEST)
    return board


def test_it_announces_its_topics_as_rosserial_does(board: SimulatedBoard) -> None:
    received = receive(board, 0.2, REQUEST)
    announced = (
        TIME_REQUEST
        + info(0, 104, b"lwheel", b"std_msgs/Int32", 128)
        + info(0, 105, b"rwheel", b"std_msgs/Int32", 128)
        + info(1, 100, b"cmd_vel", b"geometry_msgs/Twist", 64)
    )
    assert received.startswith(announced)
    assert received[len(announced) :].startswith(bytes.fromhex("ff fe"))
    assert received[len(announced) + 5 :].startswith(
        b"\x07\x00\x01" + struct.pack("<I", 30) + b"swarmctl firmware "
    )


def test_it_reports_its_version_when_it_starts(boards: Boards) -> None:
    assert b"swarmctl firmware " in receive(boards(), 0.1)


def test_it_sends_nothing_before_the_first_request(board: SimulatedBoard) -> None:
    assert receive(board, 3.0, TIME_REPLY + FORWARD) == b""
    assert board.truth.angles == (0.0, 0.0)


def test_pulses_come_at_their_rate(connected: SimulatedBoard) -> None:
    received = receive(connected, 1.0)
    assert received.count(framed(104, bytes(4)) + framed(105, bytes(4))) == 10


def test_it_asks_for_the_time_every_two_and_a_half_seconds(connected: SimulatedBoard) -> None:
    received = b"".join(receive(connected, 2.5, TIME_REPLY) for _ in range(6))
    assert received.count(TIME_REQUEST) in (5, 6)


def test_after_tx_stop_it_is_silent_and_stands(connected: SimulatedBoard) -> None:
    receive(connected, 0.3, FORWARD)
    receive(connected, 0.05, TX_STOP + FORWARD)
    assert receive(connected, 3.0, FORWARD) == b""
    assert connected.truth.speeds == (0.0, 0.0)
    assert receive(connected, 0.3, REQUEST).startswith(TIME_REQUEST)


def test_without_answers_for_eleven_seconds_the_host_is_gone(connected: SimulatedBoard) -> None:
    assert receive(connected, 10.0)
    receive(connected, 1.5)
    assert receive(connected, 3.0) == b""
    receive(connected, 0.5, FORWARD)
    assert connected.truth.angles == (0.0, 0.0)


@pytest.mark.parametrize(
    "before",
    [
        b"\xff",
        b"\xff\xff\xff",
        b"\xff\xfe\x30\x00",
        b"\x00garbage\xfe",
        framed(100, bytes(48))[:-1] + b"\x00",
        framed(100, bytes(200)),
        framed(100, bytes(47)),
        framed(40_000, bytes(48)),
        framed(7, b""),
    ],
    ids=[
        "ff",
        "three ff",
        "cut header",
        "garbage",
        "bad sum",
        "too long",
        "too short",
        "unknown",
        "empty log",
    ],
)
def test_it_finds_the_frame_behind_anything(connected: SimulatedBoard, before: bytes) -> None:
    pause = 0.05 if before.startswith(b"\xff\xfe\x30\x00") and len(before) == 4 else 0.0
    receive(connected, pause, before)
    receive(connected, 0.3, FORWARD)
    left, right = connected.truth.speeds
    assert left > right > 0


def test_a_frame_that_dawdles_is_none(connected: SimulatedBoard) -> None:
    receive(connected, 0.05, FORWARD[:20])
    receive(connected, 0.3, FORWARD[20:])
    assert connected.truth.angles == (0.0, 0.0)


def test_a_second_request_is_answered_while_driving(connected: SimulatedBoard) -> None:
    receive(connected, 0.3, FORWARD)
    received = receive(connected, 0.15, REQUEST + FORWARD)
    assert received.count(b"std_msgs/Int32") == 2
    assert connected.truth.drives[0] > 0


def test_another_baud_rate_is_noise(boards: Boards) -> None:
    board = boards(baud=115_200)
    assert TIME_REQUEST not in receive(board, 0.5, REQUEST)
    assert board.truth.baud == pytest.approx(57_600, rel=0.03)
