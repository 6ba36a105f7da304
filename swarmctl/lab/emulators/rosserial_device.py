"""The device side of rosserial (protocol version 2): frames, negotiation, time requests."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
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


TIME_REQUEST_PERIOD = 2.5  # s
LOST_AFTER = 11.0  # s without a time reply
TIME_REQUEST = frame(TIME, bytes(8))


class Device:
    """A node with ``slots`` places for subscribers and as many for publishers. Times are in s."""

    def __init__(
        self, publishers: Sequence[Topic], subscribers: Sequence[Topic], *, slots: int, buffer: int
    ) -> None:
        self._publishers = {FIRST_USER + slots + index: topic for index, topic in enumerate(publishers)}
        self._subscribers = {FIRST_USER + index: topic for index, topic in enumerate(subscribers)}
        self._buffer = buffer
        self.boot(0.0)

    def boot(self, now: float) -> None:
        """Resets the connection; its topics are not negotiated."""
        self._parser = Parser(self._buffer)
        self._configured = False
        self._requested_at = self._time_reply_at = now

    def connected(self, now: float) -> bool:
        """Whether it may publish."""
        return self._configured and now - self._time_reply_at <= LOST_AFTER

    def push(self, byte: int, now: float) -> Message | FrameError | None:
        """Takes a byte; returns the message or error that it completes."""
        return self._parser.push(byte, now)

    def respond(self, event: Message | FrameError, now: float) -> list[bytes]:
        """Returns what it sends after a protocol message or a wrong version."""
        if event is FrameError.WRONG_VERSION and not self._configured:
            return [self._request_time(now)]
        if isinstance(event, Message):
            if event.topic == PUBLISHER:
                return self._negotiate(now)
            if event.topic == TIME:
                self._time_reply_at = now
            elif event.topic == TX_STOP:
                self._configured = False
        return []

    def _request_time(self, now: float) -> bytes:
        self._requested_at = now
        return TIME_REQUEST

    def _negotiate(self, now: float) -> list[bytes]:
        """Requests the time, then announces all publishers, then all subscribers."""
        self._configured = True
        self._time_reply_at = now
        return [
            self._request_time(now),
            *(topic_info(PUBLISHER, *known, self._buffer) for known in self._publishers.items()),
            *(topic_info(SUBSCRIBER, *known, self._buffer) for known in self._subscribers.items()),
        ]

    def due(self) -> float:
        """Returns when the next time request is due."""
        return self._requested_at + TIME_REQUEST_PERIOD if self._configured else math.inf

    def tick(self, now: float) -> list[bytes]:
        """Returns what is due. Without time replies it disconnects and waits for a topic request."""
        if not self.connected(now):
            self._configured = False
        return [self._request_time(now)] if self.due() <= now else []

    def topic(self, message: Message) -> str | None:
        """Returns the subscribed topic of ``message``."""
        topic = self._subscribers.get(message.topic)
        return topic.name if topic else None

    def publish(self, name: str, payload: bytes) -> bytes:
        """Returns the frame of a message on the topic ``name``."""
        number = next(number for number, topic in self._publishers.items() if topic.name == name)
        return frame(number, payload)
