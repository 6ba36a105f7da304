"""The e-puck (GCtronic firmware, hardware 1.3): ASCII lines and chained binary requests on one line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from enum import Enum, auto
from typing import ClassVar

from swarmctl.lab.emulators.epuck_binary import BATTERY, PAYLOAD_SIZES, answer_binary, letter_of
from swarmctl.lab.emulators.motion import Chassis, clamp, wrap
from swarmctl.lab.emulators.robot import TERMINATORS, Robot, reply
from swarmctl.lab.emulators.world import Sensor, Wall, distance

WHEEL_DIAMETER = 0.041
STEPS_PER_TURN = 1000
TOP_SPEED = 1000  # steps per second
LONGEST_LINE = 80
ANSWER_LIMIT = 8192  # the robot's whole memory
MEMORY_FOR_IMAGES = 3200
SELECTOR = 3

RIGHT_SIDE = (
    Sensor(0.035, -0.010, -10.0),
    Sensor(0.025, -0.025, -40.0),
    Sensor(0.0, -0.030, -90.0),
    Sensor(-0.035, -0.020, -160.0),
)
SENSORS = RIGHT_SIDE + tuple(Sensor(s.x, -s.y, -s.heading) for s in reversed(RIGHT_SIDE))

NEXT_NUMBER = re.compile(r",\s*([+-]?[0-9]+)")

BOOT = (
    b"Selector pos 3\r\n"
    b"\f\aWELCOME to the SerCom protocol on e-Puck\r\n"
    b'the EPFL education robot type "H" for help\r\n'
)
CALIBRATION = (
    b"k, Starting calibration - Remove any object in sensors range\r\n"
    b"k, Calibration finished\r\n"
)  # fmt: skip
REMOTE_CONTROL = b"g IR check : 0x0, address : 0x0, data : 0x0\r\n"
VERSION = b"v,Version 1.2.2 August 2008 GCtronic\r\nHW version: FFFF\r\n"
HELP = b"\n" + b"".join(
    b'"%b"\t%b\r\n' % line
    for line in (
        (b"A", b"accelerometer"),
        (b"D,#,#", b"set speed left,right"),
        (b"E", b"speed left,right"),
        (b"N", b"proximity"),
        (b"Q", b"position left,right"),
        (b"S", b"stop, lights off"),
    )
)


class Reading(Enum):
    """What the robot takes the next byte for."""

    START = auto()  # the first byte of a request decides between text and binary
    TEXT_START = auto()  # a CR or LF came first: whatever follows is text, even a binary request
    TEXT = auto()
    BINARY = auto()
    PAYLOAD = auto()


class EPuck(Robot):
    """Letters may be small, apart from ``b`` and ``g``, which are commands of their own.

    Missing parameters keep their previous value and are acknowledged. Text must end with CR or LF, not both:
    the second one begins a new text, which swallows a binary request after it.
    """

    type_name: ClassVar[str] = "epuck"
    refusal: ClassVar[bytes] = b"z,Command not found\r\n"

    def __init__(
        self,
        *,
        wheel_separation: float = 0.053,
        pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
        walls: Sequence[Wall] = (),
    ) -> None:
        super().__init__(
            Chassis(
                wheel_separation=wheel_separation,
                metres_per_count=math.pi * WHEEL_DIAMETER / STEPS_PER_TURN,
                counter_bits=16,
                pose=pose,
            ),
            walls,
        )
        self._set_defaults()
        self._readings: dict[str, Callable[[], bytes]] = {
            "A": lambda: reply("a", *self.acceleration()),
            "b": lambda: reply("b", f"{BATTERY} ({(BATTERY - 2070) * 100 // 490}%)"),
            "C": lambda: reply("c", SELECTOR),
            "E": lambda: reply("e", *self.speeds),
            "G": lambda: REMOTE_CONTROL,
            "g": lambda: reply("g", *self.rotation()),
            "H": lambda: HELP,
            "I": lambda: reply("i", *self.camera, self.image_size),
            "K": lambda: CALIBRATION,
            "M": lambda: reply("m", *self.floor()),
            "N": lambda: reply("n", *self.proximity()),
            "O": lambda: reply("o", *self.ambient()),
            "Q": lambda: reply("q", *self.steps()),
            "R": lambda: reply("r") + self.power_cycle(),
            "U": lambda: reply("u", *self.volumes()),
            "V": lambda: VERSION,
            "Z": lambda: b"192: 0\r\n",
        }
        self._actions: dict[str, Callable[[str], None]] = {
            "B": lambda _: None,
            "D": self._set_speeds,
            "F": lambda _: None,
            "J": self._set_camera,
            "L": lambda _: None,
            "P": self._set_positions,
            "S": lambda _: self.chassis.drive(0.0, 0.0),
            "T": lambda _: None,
            "W": lambda parameters: scan(parameters, self._i2c),
        }

    def _set_defaults(self) -> None:
        self._reading = Reading.START
        self._line = bytearray()
        self._payload = bytearray()
        self._answer = bytearray()
        self.speeds: list[int] = [0, 0]  # as commanded, unclamped
        self._positions = [0, 0]
        self._i2c = [0, 0, 0]
        self.camera = [1, 40, 40, 8]  # mode, width, height, zoom

    def banner(self) -> bytes:
        return BOOT

    def power_cycle(self) -> bytes:
        self._set_defaults()
        return super().power_cycle()

    def replies(self, data: bytes) -> list[bytes]:
        return [answer for byte in data if (answer := self._push(byte))]

    def _push(self, byte: int) -> bytes:
        """Take one byte; what the robot sends because of it."""
        if self._reading is Reading.BINARY:
            return self._binary(byte)
        if self._reading is Reading.PAYLOAD:
            return self._binary_payload(byte)
        if self._reading is Reading.TEXT:
            return self._text(byte)
        if self._reading is Reading.START and byte & 0x80:
            self._reading = Reading.BINARY
            self._line.clear()
            self._answer.clear()
            return self._binary(byte)
        if byte in TERMINATORS:
            self._reading = Reading.TEXT_START
        elif byte or self._reading is Reading.TEXT_START:
            self._line[:] = bytes([byte])
            self._reading = Reading.TEXT
        return b""

    # Binary

    def _remember(self, byte: int) -> None:
        if len(self._line) < LONGEST_LINE:
            self._line.append(byte)

    def _binary(self, byte: int) -> bytes:
        self._remember(byte)
        if byte == 0:
            self._reading = Reading.START
            self._note(self._line.hex(" "))
            return bytes(self._answer)
        if PAYLOAD_SIZES.get(letter_of(byte)):
            self._reading = Reading.PAYLOAD
            self._payload[:] = bytes([byte])
            return b""
        return self._collect(letter_of(byte), b"")

    def _binary_payload(self, byte: int) -> bytes:
        self._remember(byte)
        self._payload.append(byte)
        letter = letter_of(self._payload[0])
        if len(self._payload) <= PAYLOAD_SIZES[letter]:
            return b""
        self._reading = Reading.BINARY
        return self._collect(letter, bytes(self._payload[1:]))

    def _collect(self, letter: str, payload: bytes) -> bytes:
        at_once, at_end = answer_binary(self, letter, payload)
        if len(self._answer) + len(at_end) <= ANSWER_LIMIT:
            self._answer += at_end
        return at_once

    # Text

    def _text(self, byte: int) -> bytes:
        if byte not in TERMINATORS:
            if len(self._line) < LONGEST_LINE:
                self._line.append(byte)
            return b""
        self._reading = Reading.START
        line = self._line.decode("latin-1")
        self._note(line)
        letter = line[0] if line[0] in "bg" else line[0].upper()
        return self._answer_text(letter, line[1:])

    def _answer_text(self, letter: str, parameters: str) -> bytes:
        if letter in self._readings:
            return self._readings[letter]()
        if letter in self._actions:
            self._actions[letter](parameters)
            return reply(letter.lower())
        if letter == "Y":
            scan(parameters, self._i2c)
            return reply("y", *self._i2c[:2]) + reply("y", self.background(20, 1)[0])
        return self.refusal

    # Motion

    def _set_speeds(self, parameters: str) -> None:
        scan(parameters, self.speeds)
        self.take_up_speeds()

    def take_up_speeds(self) -> None:
        """Turn the wheels as ``speeds`` says, within what the motors can do."""
        step = self.chassis.left.metres_per_count
        left, right = (clamp(speed, TOP_SPEED) * step for speed in self.speeds)
        self.chassis.drive(left, right)

    def _set_positions(self, parameters: str) -> None:
        scan(parameters, self._positions)
        self.set_steps(self._positions)

    def set_steps(self, steps: Sequence[int]) -> None:
        self._positions = list(steps)
        self.chassis.left.count, self.chassis.right.count = steps

    def steps(self) -> list[int]:
        return [wheel.count for wheel in self.chassis.wheels]

    # Sensors

    def background(self, level: int, channels: int) -> list[int]:
        return self._background(level, channels)

    def proximity(self) -> list[int]:
        """12 bits, calibrated, larger is nearer: (0.5 m / range) squared."""
        ranges = (distance(sensor, self._pose, self.walls) for sensor in SENSORS)
        seen = [round(min(4095.0, (0.5 / max(metres, 0.001)) ** 2)) for metres in ranges]
        return [max(pair) for pair in zip(self._background(4, len(SENSORS)), seen, strict=True)]

    def ambient(self) -> list[int]:
        return self._background(3700, len(SENSORS))

    def acceleration(self) -> list[int]:
        sideways, ahead, up = self._background(-3, 3)
        return [sideways, ahead, 16384 + up]

    def rotation(self) -> list[int]:
        return self._background(-3, 3)

    def volumes(self) -> list[int]:
        return self._background(14, 3)

    def floor(self) -> list[int]:
        return self._background(900, 5)

    # Camera

    @property
    def image_size(self) -> int:
        mode, width, height, _ = self.camera
        return wrap(width * height * (1 if mode == 0 else 2), 16)

    def _set_camera(self, parameters: str) -> None:
        scan(parameters, self.camera)
        if not 0 < self.image_size <= MEMORY_FOR_IMAGES:
            self.camera[:3] = [1, 40, 40]

    def image(self) -> bytes:
        """Mode, width and height, then a gradient that moves from image to image."""
        start = self._background(0, 1)[0]
        return bytes(value & 0xFF for value in self.camera[:3]) + bytes(
            (start + index) & 0xFF for index in range(self.image_size)
        )


def scan(parameters: str, values: list[int]) -> None:
    """Read ``,number,number...`` into ``values``, 16 bits each; from the first missing one on they stay."""
    position = 0
    for index in range(len(values)):
        match = NEXT_NUMBER.match(parameters, position)
        if match is None:
            return
        values[index] = wrap(int(match[1]), 16)
        position = match.end()
