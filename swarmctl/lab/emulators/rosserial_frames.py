"""Frames of rosserial (protocol version 2): made, taken apart as the Arduino client does, and spoilt."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum, auto
from random import Random

from swarmctl.lab.emulators.faults import Faults

START, VERSION = 0xFF, 0xFE
PUBLISHER, SUBSCRIBER, PARAMETER, LOG, TIME, TX_STOP = 0, 1, 6, 7, 10, 11
FIRST_USER = 100  # topics of one's own begin here
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
    """The checksum that ``data`` needs."""
    return 255 - sum(data) % 256


def frame(topic: int, payload: bytes = b"") -> bytes:
    """``payload`` for ``topic`` as it goes over the line."""
    length, body = struct.pack("<H", len(payload)), struct.pack("<H", topic) + payload
    return bytes([START, VERSION, *length, _rest(length), *body, _rest(body)])


def string(text: str) -> bytes:
    """A text as ROS serialises it."""
    return struct.pack("<I", len(text)) + text.encode()


def topic_info(kind: int, number: int, topic: Topic, buffer: int) -> bytes:
    """The announcement of a publisher or subscriber."""
    names = b"".join(map(string, (topic.name, topic.type, topic.md5)))
    return frame(kind, struct.pack("<H", number) + names + struct.pack("<i", buffer))


def log(text: str, level: int = INFO) -> bytes:
    return frame(LOG, bytes([level]) + string(text))


@dataclass(frozen=True)
class Message:
    """What a whole frame brought."""

    topic: int
    payload: bytes


class Mishap(Enum):
    """What may come of bytes besides messages."""

    WRONG_VERSION = auto()
    OVERRUN = auto()  # the frame was longer than the buffer that it was written to


class Parser:
    """Byte by byte, without looking back: after a byte that does not fit it waits for the next frame, so an
    ``ff`` right before a frame costs that frame.
    """

    def __init__(self, buffer: int) -> None:
        self._buffer = buffer
        self._frame = bytearray()
        self._began = 0.0

    def push(self, byte: int, now: float) -> Message | Mishap | None:
        """Take a byte that arrived at ``now`` (s); what it completes."""
        if self._frame and now - self._began > FRAME_TIME:
            self._frame.clear()
        if not self._frame:
            self._began = now
        self._frame.append(byte)
        result = self._look()
        if result is not None:
            self._frame.clear()
        return result if isinstance(result, (Message, Mishap)) else None

    def _look(self) -> Message | Mishap | bool | None:
        """None while the frame may still become one; False if it cannot."""
        data, size = self._frame, len(self._frame)
        if size == 1:
            return None if data[0] == START else False
        if size == 2:
            return None if data[1] == VERSION else Mishap.WRONG_VERSION
        if size < 5:
            return None
        if size == 5:
            return None if _rest(data[2:4]) == data[4] else False
        length = int.from_bytes(data[2:4], "little")
        if size - 7 > self._buffer:  # nobody checks the length before the bytes are written
            return Mishap.OVERRUN
        if size < length + 8:
            return None
        if _rest(data[5:-1]) != data[-1]:
            return False
        return Message(int.from_bytes(data[5:7], "little"), bytes(data[7:-1]))


def spoilt(data: bytes, faults: Faults, random: Random) -> bytes:
    """One frame of a device with the faults that only frames can have."""
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
