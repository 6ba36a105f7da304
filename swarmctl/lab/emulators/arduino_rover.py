"""The second paper's rover: an Arduino UNO with rosserial, two wheels with 20 pulses a turn."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from random import Random
from typing import ClassVar

from swarmctl.lab.emulators import rosserial_frames
from swarmctl.lab.emulators.differential_drive import Chassis
from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.rosserial_device import Device
from swarmctl.lab.emulators.rosserial_frames import TIME, TX_STOP, FrameError, Message, Topic, log
from swarmctl.lab.emulators.serial_faults import Faults

TICKS_PER_TURN = 20
BOOTLOADER = 1.5  # s after a reset in which received bytes are lost
SLOTS, BUFFER = 4, 128  # of its node: subscribers and publishers, bytes of a message
TICKS = ("lwheel", "rwheel")
PUBLISHERS = tuple(Topic(name, "std_msgs/Int32", "da5909fbe378aeaf85e547e830cc1bb7") for name in TICKS)
SUBSCRIBERS = (Topic("cmd_vel", "geometry_msgs/Twist", "9f195f881246fdfa2798d1d3eebca84a"),)
SOON = 1e-6  # s; tolerance of due times


class ArduinoRover(Robot):
    """Arduino rover: rosserial, wheel ticks, a dead-man of its own; reset when its port is opened.

    The encoders have one channel: a tick counts in the direction of the last command. ``firmware`` is sent in
    a log message when its topics are requested; with ``dtr``, opening the port resets it, as on an UNO.
    """

    type_name: ClassVar[str] = "arduino-rover"
    refusal = b""
    uses_rosserial: ClassVar[bool] = True
    changeable: ClassVar[Mapping[str, type]] = {**Robot.changeable, "firmware": str}

    def __init__(
        self,
        *,
        wheel_separation: float = 0.130,
        wheel_diameter: float = 0.065,
        top_speed: float = 0.6,
        rate: float = 20.0,
        dead_man: float = 0.4,
        firmware: str = "",
        dtr: bool = True,
    ) -> None:
        for name, value, most in (
            ("wheel_diameter", wheel_diameter, 1.0),
            ("top_speed", top_speed, 10.0),
            ("rate", rate, 1000.0),
            ("dead_man", dead_man, 3600.0),
        ):
            if not 0.0 < value <= most:
                raise ValueError(f"{name!r} is more than 0 and at most {most:g}, not {value!r}")
        super().__init__(
            Chassis(
                wheel_separation=wheel_separation,
                metres_per_count=math.pi * wheel_diameter / TICKS_PER_TURN,
                counter_bits=32,
            )
        )
        self.firmware = firmware
        self._top_speed = top_speed
        self._period = 1 / rate
        self._dead_man = dead_man
        self._dtr = dtr
        self._device = Device(PUBLISHERS, SUBSCRIBERS, slots=SLOTS, buffer=BUFFER)
        self._awake_at = 0.0
        self._publish_at = math.inf
        self._stop_at = math.inf

    @property
    def _now(self) -> float:
        return self.chassis.time

    def power_cycle(self) -> bytes:
        self._awake_at = self._now + BOOTLOADER
        self._publish_at = self._stop_at = math.inf
        self._device.boot(self._awake_at)
        return super().power_cycle()

    def opened(self) -> None:
        if self._dtr:
            self.power_cycle()

    def closed(self) -> None:
        """The board does not notice."""

    def advance(self, dt: float) -> None:
        """The dead-man stops the wheels after ``dead_man`` seconds without a command."""
        until_stop = max(0.0, self._stop_at - self._now)
        if dt >= until_stop:
            super().advance(until_stop)
            self.chassis.drive(0.0, 0.0)
            self._stop_at = math.inf
            dt -= until_stop
        super().advance(dt)

    # Input

    def replies(self, data: bytes) -> list[bytes]:
        if self._now < self._awake_at:
            return []
        return [answer for byte in data for answer in self._push(byte)]

    def _push(self, byte: int) -> list[bytes]:
        event = self._device.push(byte, self._now)
        if event is None or self._now < self._awake_at:
            return []
        if event is FrameError.OVERRUN:  # memory behind the buffer is overwritten: the board resets
            self.power_cycle()
            return []
        was_connected = self._device.connected(self._now)
        answers = self._device.respond(event, self._now)
        if isinstance(event, Message):
            self._take(event)
        if self._device.connected(self._now) and not was_connected:
            self._publish_at = self._now + self._period
        if answers and self.firmware and self._device.connected(self._now):
            answers.append(log(f"swarmctl firmware {self.firmware}"))
        return answers

    def _take(self, message: Message) -> None:
        protocol = {0: "topics", TIME: "time", TX_STOP: "tx stop"}
        name = protocol.get(message.topic) or self._device.topic(message)
        if name == "cmd_vel" and len(message.payload) == 48:
            v, *_, omega = struct.unpack("<6d", message.payload)
            self._drive(v, omega)
            name = f"cmd_vel {v:g} {omega:g}"
        self._note(name or f"unknown topic {message.topic}")

    def _drive(self, v: float, omega: float) -> None:
        """Takes m/s and rad/s; a command that is too fast is scaled down on the same arc."""
        half = omega * self.chassis.wheel_separation / 2
        wheels = [v - half, v + half]
        if not all(map(math.isfinite, wheels)):
            wheels = [0.0, 0.0]
        too_fast = max(1.0, max(map(abs, wheels)) / self._top_speed)
        self.chassis.drive(*(speed / too_fast for speed in wheels))
        self._stop_at = self._now + self._dead_man

    # Output

    def unsolicited_due(self) -> float:
        return min(self._device.due(), self._publish_at) - self._now

    def unsolicited(self) -> list[bytes]:
        now = self._now + SOON
        output = self._device.tick(now)
        if not self._device.connected(now):
            self._publish_at = math.inf
        while self._publish_at <= now:
            self._publish_at += self._period
            counts = zip(TICKS, self.chassis.wheels, strict=True)
            output += [self._device.publish(name, struct.pack("<i", wheel.count)) for name, wheel in counts]
        return output

    def corrupt(self, frame: bytes, faults: Faults, random: Random) -> bytes:
        return rosserial_frames.corrupt(frame, faults, random)
