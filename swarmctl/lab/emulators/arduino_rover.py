"""The second paper's rover: an Arduino UNO with rosserial, two wheels with 20 pulses a turn."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from random import Random
from typing import ClassVar

from swarmctl.lab.emulators import rosserial_device
from swarmctl.lab.emulators.bootloader import FLASH, WAIT, Bootloader
from swarmctl.lab.emulators.differential_drive import Chassis
from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.rosserial_device import TIME, TX_STOP, Device, FrameError, Message, Topic, log
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.uno import LEFT, RIGHT, Fault, Motor, Truth, Uno, image

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
        return rosserial_device.corrupt(frame, faults, random)


SLICE = 0.002  # s; the period of reading the board, and the length of the arcs of its path


class SimulatedBoard(Robot):
    """A differential drive whose board runs ``firmware``, an Intel HEX file for an ATmega328P at 16 MHz.

    The board sends at its own pace, so ``replies`` returns nothing: all output comes from ``unsolicited``.
    ``faults`` and ``load`` may be set at any time. After a reset from outside its boot loader runs, for
    ``boot`` seconds without input. It is a process: call ``close`` at the end.
    """

    type_name: ClassVar[str] = "arduino-rover"
    refusal = b""
    uses_rosserial: ClassVar[bool] = True

    def __init__(
        self,
        firmware: Path,
        *,
        baud: int = 57600,
        wheel_radius: float = 0.0325,
        wheel_separation: float = 0.13,
        left: Motor = LEFT,
        right: Motor = RIGHT,
        boot: float = WAIT,
    ) -> None:
        super().__init__(Chassis(wheel_separation=wheel_separation, metres_per_count=1.0, counter_bits=32))
        self.faults = Fault.NONE
        self.load = (0.0, 0.0)
        self._radius = wheel_radius
        program = image(firmware)
        self.bootloader = Bootloader(bytearray(program.ljust(FLASH, b"\xff")), boot)
        self._uno = Uno(baud=baud, left=left, right=right)
        self._truth, self._output = self._uno.run(0, b"", self.faults, self.load, program)
        self._received = b""
        self._time = 0.0  # s, as requested; the board's own follows it to the microsecond
        self._since_read = 0.0

    @property
    def truth(self) -> Truth:
        """The true state of the board and its wheels."""
        return self._truth

    def replies(self, data: bytes) -> list[bytes]:
        """Sends bytes to the board's UART; its answers come later, by ``unsolicited``."""
        self._received += data
        if data:
            self._note(data.hex())
        return []

    def power_cycle(self) -> bytes:
        """Presses the reset button: pins are released and the boot loader starts. The wheels roll on."""
        self.bootloader.enter()
        self._run(0, Fault.RESET)
        return b""

    def opened(self) -> None:
        """The DTR line is wired to the reset, as on every UNO."""
        self.power_cycle()

    def closed(self) -> None:
        """The board does not notice."""

    def crash(self) -> None:
        """Makes the program hang, as a broken one might."""
        self._run(0, Fault.HANG)

    def advance(self, dt: float) -> None:
        while dt > 0.0:
            step = min(dt, SLICE)
            self._step(step)
            dt -= step

    def unsolicited_due(self) -> float:
        return max(0.0, SLICE - self._since_read)

    def unsolicited(self) -> list[bytes]:
        self._since_read = 0.0
        output, self._output = self._output, b""
        return [output] if output else []

    def close(self) -> None:
        """Ends the simulator process."""
        self._uno.close()

    def _step(self, dt: float) -> None:
        before = self._truth.angles
        self._time += dt
        self._since_read += dt
        if self.bootloader.active:
            self._load(dt)
        self._run(max(0, round((self._time - self._truth.time) * 1e6)))
        rolled = (after - angle for after, angle in zip(self._truth.angles, before, strict=True))
        left, right = (angle * self._radius for angle in rolled)
        self.chassis.drive(left / dt, right / dt)
        self.chassis.advance(dt)
        self.chassis.drive(*(speed * self._radius for speed in self._truth.speeds))

    def _load(self, dt: float) -> None:
        """Runs the boot loader; when it ends, the sketch in the flash starts."""
        loader = self.bootloader
        received, self._received = self._received, b""
        self._output += loader.run_for(dt, received)
        if not loader.active:
            self._run(0, Fault.RESET, bytes(loader.memory) if loader.has_written else b"")
            loader.has_written = False

    def _run(self, us: int, once: Fault = Fault.NONE, flash: bytes = b"") -> None:
        faults, received = self.faults | once, b""
        if self.bootloader.active:
            faults |= Fault.HELD
        else:
            received, self._received = self._received, b""
        self._truth, output = self._uno.run(us, received, faults, self.load, flash)
        self._output += output


BOARD_SUFFIX = ".board.json"


def write_board(
    firmware: Path, *, baud: int, wheel_radius: float, wheel_separation: float, left: Motor, right: Motor
) -> Path:
    """Writes the board file of ``firmware`` (Intel HEX); lengths in m. Returns its path."""
    board = {
        "firmware": str(firmware.resolve()),
        "baud": baud,
        "wheel_radius": wheel_radius,
        "wheel_separation": wheel_separation,
        "left": asdict(left),
        "right": asdict(right),
    }
    file = firmware.with_suffix(BOARD_SUFFIX).resolve()
    file.write_text(json.dumps(board, indent=2) + "\n", "utf-8")
    return file


def read_board(file: Path) -> SimulatedBoard:
    """Returns the board described by a file of ``write_board``, switched on."""
    board = json.loads(file.read_text("utf-8"))
    left, right = Motor(**board.pop("left")), Motor(**board.pop("right"))
    return SimulatedBoard(Path(board.pop("firmware")), **board, left=left, right=right)
