"""Frames of rosserial (protocol version 2): encoded, parsed like the Arduino client, and corrupted."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum, auto
from random import Random

from swarmctl.lab.emulators.serial_faults import Faults

START, VERSION = 0xFF, 0xFE
PUBLISHER, SUBSCRIBER, PARAMETER, LOG, TIME, TX_STOP = 0, 1, 6, 7, 10, 11
FIRST_USER = 100  # first id of application topics
FRAME_TIME = 0.020  # s, from the first byte to the last
INFO = 1  # level of a log message
LONGER_THAN_ANY = 1024  # bytes


@dataclass(frozen=True)
class Topic:
    """A topic as a device announces it."""

    name: str
    type: str
    md5: str


def _rest(data: bytes | bytearray) -> int:
    """Returns the checksum of ``data``."""
    return 255 - sum(data) % 256


def frame(topic: int, payload: bytes = b"") -> bytes:
    """Returns the frame of ``payload`` for ``topic``."""
    length, body = struct.pack("<H", len(payload)), struct.pack("<H", topic) + payload
    return bytes([START, VERSION, *length, _rest(length), *body, _rest(body)])


def string(text: str) -> bytes:
    """Returns a serialised ROS string."""
    return struct.pack("<I", len(text)) + text.encode()


def topic_info(kind: int, number: int, topic: Topic, buffer: int) -> bytes:
    """Returns the announcement of a publisher or subscriber."""
    names = b"".join(map(string, (topic.name, topic.type, topic.md5)))
    return frame(kind, struct.pack("<H", number) + names + struct.pack("<i", buffer))


def log(text: str, level: int = INFO) -> bytes:
    """Returns the frame of a log message."""
    return frame(LOG, bytes([level]) + string(text))


@dataclass(frozen=True)
class Message:
    """The content of a valid frame."""

    topic: int
    payload: bytes


class FrameError(Enum):
    """What a parser reports besides messages."""

    WRONG_VERSION = auto()
    OVERRUN = auto()  # the frame was longer than the buffer that it was written to


class Parser:
    """Parses byte by byte without looking back: after a wrong byte it waits for the next frame, so a stray
    ``ff`` before a frame loses that frame.
    """

    def __init__(self, buffer: int) -> None:
        self._buffer = buffer
        self._frame = bytearray()
        self._began = 0.0

    def push(self, byte: int, now: float) -> Message | FrameError | None:
        """Takes a byte received at ``now`` (s); returns what it completes."""
        if self._frame and now - self._began > FRAME_TIME:
            self._frame.clear()
        if not self._frame:
            self._began = now
        self._frame.append(byte)
        result = self._check()
        if result is not None:
            self._frame.clear()
        return result if isinstance(result, (Message, FrameError)) else None

    def _check(self) -> Message | FrameError | bool | None:
        """None while the frame may still become one; False if it cannot."""
        data, size = self._frame, len(self._frame)
        if size == 1:
            return None if data[0] == START else False
        if size == 2:
            return None if data[1] == VERSION else FrameError.WRONG_VERSION
        if size < 5:
            return None
        if size == 5:
            return None if _rest(data[2:4]) == data[4] else False
        length = int.from_bytes(data[2:4], "little")
        if size - 7 > self._buffer:  # the client writes the bytes before it checks the length
            return FrameError.OVERRUN
        if size < length + 8:
            return None
        if _rest(data[5:-1]) != data[-1]:
            return False
        return Message(int.from_bytes(data[5:7], "little"), bytes(data[7:-1]))


def corrupt(data: bytes, faults: Faults, random: Random) -> bytes:
    """Returns a frame of a device with the frame faults applied."""
    topic, payload = int.from_bytes(data[5:7], "little"), data[7:-1]
    if faults.no_time and topic == TIME:
        return b""
    if faults.wrong_md5 and topic in (PUBLISHER, SUBSCRIBER):
        data = frame(topic, payload[:-36] + b"0" * 32 + payload[-4:])
    if faults.strikes(faults.overlong, random):
        data = frame(topic, payload + bytes(LONGER_THAN_ANY))
    if faults.strikes(faults.bad_length, random):
        data = data[:4] + bytes([data[4] ^ 0xFF]) + data[5:]
    if faults.strikes(faults.bad_checksum, random):
        data = data[:-1] + bytes([data[-1] ^ 0xFF])
    if faults.strikes(faults.stray_ff, random):
        data = bytes([START]) + data
    return data
