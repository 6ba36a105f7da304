"""Encodes and decodes rosserial's frames.

ff fe | length, 2 bytes | its checksum | topic id, 2 bytes | message | checksum of id and message
(https://wiki.ros.org/rosserial/Overview/Protocol; all numbers little-endian).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

SYNC = b"\xff\xfe"
OVERHEAD = 8  # bytes of a frame beside its message
LONGEST = 4096  # bytes of a message; the largest buffer of a client library's boards takes 2048
_HEADER = 7

ID_PUBLISHER, ID_SUBSCRIBER = 0, 1
ID_SERVICES = (2, 3, 4, 5)  # server and client, each as a publisher and as a subscriber
ID_PARAMETER, ID_LOG, ID_TIME, ID_TX_STOP = 6, 7, 10, 11
FIRST_TOPIC_ID = 100

_OLD_SYNC = b"\xff\xff"
_OLD_HEADER = 6
_OLD_MEMORY = 600  # bytes in which a frame of the old protocol is looked for; its announcements have about 90


@dataclass(frozen=True)
class Frame:
    """One frame with its topic and its message."""

    topic_id: int
    message: bytes


def encode(topic_id: int, message: bytes = b"") -> bytes:
    """Returns a message as a frame, with both checksums."""
    length, body = struct.pack("<H", len(message)), struct.pack("<H", topic_id) + message
    return SYNC + length + _checksum(length) + body + _checksum(body)


def _checksum(data: bytes) -> bytes:
    return bytes([255 - sum(data) % 256])


REQUEST_TOPICS = encode(ID_PUBLISHER)
TX_STOP = encode(ID_TX_STOP)
#: The request of rosserial 0.4 and earlier. The zero ends what a board of today takes for a frame.
OLD_REQUEST_TOPICS = b"\xff\xff\x00\x00\x00\x00\xff\x00"


@dataclass
class Losses:
    """Received data without a valid message: bytes, then frames by their fault."""

    bytes: int = 0
    lengths: int = 0
    checksums: int = 0
    cut_short: int = 0

    @property
    def frames(self) -> int:
        """The number of damaged frames."""
        return self.lengths + self.checksums + self.cut_short


class FrameReader:
    """Cuts a stream of bytes into frames. Invalid bytes before a good frame do not lose it."""

    def __init__(self) -> None:
        self.losses = Losses()
        self.good = 0  # frames
        self.old_protocol = False  # frames of rosserial 0.4 came instead of good ones
        self._bytes = bytearray()
        self._skipped = bytearray()  # the last skipped bytes, until a good frame arrives

    @property
    def within_frame(self) -> bool:
        """Whether a frame has begun and is not complete."""
        return bool(self._bytes)

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that ``data`` completes."""
        self._bytes += data
        found = []
        while True:
            frame = self._next()
            if frame is None:
                break
            found.append(frame)
        if not self.good and not self.old_protocol:
            self.old_protocol = _has_old_frame(self._skipped)
        return found

    def give_up(self) -> list[Frame]:
        """Drops the incomplete frame; returns the frames that are within its bytes."""
        self.losses.cut_short += 1
        self._skip(len(SYNC))
        return self.feed(b"")

    def _next(self) -> Frame | None:
        """The next good frame; None while bytes of it are missing."""
        while True:
            self._skip(_start(self._bytes))
            if len(self._bytes) < _HEADER:
                return None
            length, topic_id = struct.unpack_from("<HxH", self._bytes, 2)
            if sum(self._bytes[2:5]) % 256 != 255 or length > LONGEST:
                self.losses.lengths += 1
            elif len(self._bytes) < length + OVERHEAD:
                return None
            elif sum(self._bytes[5 : length + OVERHEAD]) % 256 != 255:
                self.losses.checksums += 1
            else:
                message = bytes(self._bytes[_HEADER : _HEADER + length])
                del self._bytes[: length + OVERHEAD]
                self.good += 1
                return Frame(topic_id, message)
            self._skip(len(SYNC))  # and no more: what seems to be its message may hold a good frame

    def _skip(self, count: int) -> None:
        skipped = self._bytes[:count]
        self.losses.bytes += len(skipped)
        if not self.good:
            self._skipped = (self._skipped + skipped)[-_OLD_MEMORY:]
        del self._bytes[:count]


def _start(data: bytearray) -> int:
    """Where a frame may begin in ``data``: its end, if nowhere."""
    found = data.find(SYNC)
    return found if found >= 0 else len(data) - data.endswith(SYNC[:1])


def _has_old_frame(data: bytearray) -> bool:
    """Whether a whole frame of version 1 is in ``data``: ff ff, topic id, length, message, one checksum."""
    at = data.find(_OLD_SYNC)
    while 0 <= at <= len(data) - _OLD_HEADER - 1:
        end = at + _OLD_HEADER + int.from_bytes(data[at + 4 : at + 6], "little")
        if end < len(data) and sum(data[at + 2 : end + 1]) % 256 == 255:
            return True
        at = data.find(_OLD_SYNC, at + 1)
    return False
