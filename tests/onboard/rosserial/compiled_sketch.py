"""A board with a sketch, as rosserial's node_handle.h behaves, on a fake port with a fake clock."""

from __future__ import annotations

import struct
from typing import Protocol

from tests.onboard.rosserial.fakes import (
    CMD_VEL,
    LWHEEL,
    RWHEEL,
    TIME_REQUEST,
    framed,
    text,
)

STARTS = 1.5  # s an UNO's bootloader takes after a reset
TICKS_EVERY = 0.1
TIME_EVERY = 2.5
FORGETS = 11.0  # s after the last answer to its time request


class Clock(Protocol):
    now: float

    def __call__(self) -> float: ...


class Sketch:
    """Subscribes to cmd_vel (id 100), publishes lwheel and rwheel (125, 126). It is its own port."""

    def __init__(self, clock: Clock, gone: type[Exception] = OSError) -> None:
        self.clock = clock
        self.gone = gone
        self.plugged = True
        self.silent = False
        self.resets_on_open = True
        self.announces = [LWHEEL, RWHEEL, CMD_VEL]
        self.firmware = "0123456789ab"
        self.ticks = [0, 0]
        self.buffer_size = 280
        self.commands: list[tuple[float, float, float]] = []  # when, m/s, rad/s
        self.received: list[tuple[float, int, bytes]] = []
        self.opened: list[float] = []
        self.waiting = b""
        self.started = clock()
        self.configured = False
        self._frame = b""
        self._answered = self._requested = self._published = 0.0

    def open(self) -> Sketch:
        self.opened.append(self.clock())
        self._check()
        if self.resets_on_open:
            self.reset()
        return self

    def reset(self) -> None:
        self.started = self.clock() + STARTS
        self.configured = False
        self.waiting = b"\xf0\xff\xfe boot"
        self._frame = b""
        self.ticks = [0, 0]

    def due(self) -> float:
        """When it sends next if it receives nothing."""
        return (
            min(self._published + TICKS_EVERY, self._requested + TIME_EVERY)
            if self.configured
            else float("inf")
        )

    def live(self) -> None:
        """Send what is due by now."""
        now = self.clock()
        if self.configured and now > self._answered + FORGETS:
            self.configured = False
        if self.configured and now >= self._published + TICKS_EVERY:
            self._published = now
            for topic_id, ticks in zip((125, 126), self.ticks, strict=True):
                self.send(framed(topic_id, struct.pack("<i", ticks)))
        if self.configured and now >= self._requested + TIME_EVERY:
            self._requested = now
            self.send(TIME_REQUEST)

    def send(self, data: bytes) -> None:
        if not self.silent:
            self.waiting += data

    def log(self, level: int, message: str) -> None:
        self.send(framed(7, bytes([level]) + text(message)))

    def write(self, data: bytes) -> None:
        self._check()
        if self.clock() < self.started:  # the bootloader discards it
            return
        for byte in data:
            self._parse(byte)

    def read(self, timeout: float) -> bytes:
        self._check()
        if not self.waiting:
            self.clock.now += timeout
        data, self.waiting = self.waiting, b""
        return data

    def drain(self) -> None:
        self.waiting = b""

    def close(self) -> None:
        """Nothing to release."""

    def _parse(self, byte: int) -> None:
        """Byte by byte; a wrong byte discards the frame up to and including it."""
        frame = self._frame = self._frame + bytes([byte])
        length = len(frame)
        if (length <= 2 and frame != b"\xff\xfe"[:length]) or (length == 5 and sum(frame[2:]) % 256 != 255):
            self._frame = b""
        elif length >= 8 and length == 8 + frame[2] + 256 * frame[3]:
            self._frame = b""
            if sum(frame[5:]) % 256 == 255:
                self._handle(frame[5] + 256 * frame[6], frame[7:-1])

    def _handle(self, topic_id: int, message: bytes) -> None:
        assert len(message) <= self.buffer_size, "written beyond the board's buffer"
        now = self.clock()
        self.received.append((now, topic_id, message))
        if topic_id == 0:
            self._answered = self._requested = self._published = now
            self.send(TIME_REQUEST)
            self.send(b"".join(self.announces))
            self.configured = True
            if self.firmware:
                self.log(1, f"swarmctl firmware {self.firmware}")
        elif topic_id == 10:
            self._answered = now
        elif topic_id == 11:
            self.configured = False
        elif topic_id == 100:
            linear, *_, angular = struct.unpack("<6d", message)
            self.commands.append((now, linear, angular))

    def _check(self) -> None:
        if not self.plugged:
            raise self.gone("/dev/robot is gone")
