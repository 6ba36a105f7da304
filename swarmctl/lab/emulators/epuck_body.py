"""The common part of both e-puck generations: wheels, lights, sound, camera, sensors and the protocol."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from swarmctl.lab.emulators.differential_drive import Chassis, Sensor, clamp, distance, wrap
from swarmctl.lab.emulators.robot import Robot, reply
from swarmctl.lab.emulators.sercom import Binary, End, Reader, Text, scan

WHEEL_DIAMETER = 0.041
STEPS_PER_TURN = 1000
ANSWER_LIMIT = 8192  # the robot's whole memory
MEMORY_FOR_IMAGES = 3200
RING = 8  # lights around the robot, clockwise from the front

RIGHT_SIDE = (
    Sensor(0.035, -0.010, -10.0),
    Sensor(0.025, -0.025, -40.0),
    Sensor(0.0, -0.030, -90.0),
    Sensor(-0.035, -0.020, -160.0),
)
SENSORS = RIGHT_SIDE + tuple(Sensor(s.x, -s.y, -s.heading) for s in reversed(RIGHT_SIDE))


class EPuckBody(Robot):
    """Letters may be small, apart from ``b`` and ``g``, which are commands of their own.

    Missing parameters keep their previous value and are acknowledged. The selector is read when the robot
    starts; only some positions run the sercom protocol, others send no replies.
    """

    refusal = b"z,Command not found\r\n"
    changeable: ClassVar[Mapping[str, type]] = {**Robot.changeable, "selector": int}

    int_bits: ClassVar[int]  # of the processor's numbers
    top_speed: ClassVar[int]  # steps per second
    protocol_positions: ClassVar[frozenset[int]]  # selector positions that run this protocol
    turn_unit: ClassVar[float]  # of the gyroscope, degrees per second
    payloads: ClassVar[Mapping[str, int]]  # bytes after a binary letter

    texts: ClassVar[Mapping[str, Callable[..., bytes]]]  # each takes the robot and the parameters
    binaries: ClassVar[Mapping[str, Callable[..., bytes]]]  # each takes the robot and the payload

    def __init__(self, *, wheel_separation: float, counter_bits: int, selector: int) -> None:
        super().__init__(
            Chassis(
                wheel_separation=wheel_separation,
                metres_per_count=math.pi * WHEEL_DIAMETER / STEPS_PER_TURN,
                counter_bits=counter_bits,
            )
        )
        self.selector = selector
        self._set_defaults()

    def _set_defaults(self) -> None:
        self._runs = self._selector
        self._reader = Reader(self.payloads)
        self._answer = bytearray()
        self.speeds: list[int] = [0, 0]  # as commanded, unclamped
        self.positions = [0, 0]
        self.light = [0, 0]  # the number and the action of the latest L; B and F change the action
        self.sound_number = [0]
        self.i2c = [0, 0, 0]
        self._images = 0  # taken so far
        self.image_settings = [1, 40, 40, 8]  # mode, width, height, zoom

    @property
    def selector(self) -> int:
        """The position of the selector, 0 to 15. Setting it raises ``ValueError`` out of range."""
        return self._selector

    @selector.setter
    def selector(self, position: int) -> None:
        if not 0 <= position <= 15:
            raise ValueError(f"'selector' is a position from 0 to 15, not {position!r}")
        self._selector = position

    @property
    def runs_protocol(self) -> bool:
        """Whether the selector position at the start runs this protocol."""
        return self._runs in self.protocol_positions

    @abstractmethod
    def set_ring(self, number: int, action: int) -> None:
        """Switches one of the ring off (0), on (1) or toggles it (anything else)."""

    def power_cycle(self) -> bytes:
        self._set_defaults()
        return super().power_cycle()

    def replies(self, data: bytes) -> list[bytes]:
        return [answer for byte in data if (answer := self._push(byte))] if self.runs_protocol else []

    def _push(self, byte: int) -> bytes:
        """Takes one byte; returns what the robot sends."""
        match self._reader.push(byte):
            case Text(line):
                self._note(line)
                letter = line[0] if line[0] in "bg" else line[0].upper()
                return self.texts[letter](self, line[1:]) if letter in self.texts else self.refusal
            case Binary("U", _) if "U" in self.binaries:
                self._collect(bytes([99]))  # the index of the newest sample, sent first
                return self.binaries["U"](self, b"")
            case Binary(letter, payload) if letter in self.binaries:
                self._collect(self.binaries[letter](self, payload))
            case End(request):
                self._note(request.hex(" "))
                answer = bytes(self._answer)
                self._answer.clear()
                return answer
        return b""

    def _collect(self, answer: bytes) -> None:
        if len(self._answer) + len(answer) <= ANSWER_LIMIT:
            self._answer += answer

    # Motion

    def take_up_speeds(self) -> None:
        """Applies ``speeds``, limited to the top speed."""
        step = self.chassis.left.metres_per_count
        left, right = (clamp(wrap(speed, 16), self.top_speed) * step for speed in self.speeds)
        self.chassis.drive(left, right)

    def set_steps(self, steps: Sequence[int]) -> None:
        """Sets both step counters."""
        self.positions = list(steps)
        self.chassis.left.count, self.chassis.right.count = steps

    def steps(self) -> list[int]:
        """Returns both step counters."""
        return [wheel.count for wheel in self.chassis.wheels]

    # Lights and sound

    def set_light(self, name: str, action: int) -> None:
        """Switches a light off (0), on (1) or toggles it (anything else)."""
        self.lights[name] = action if action in (0, 1) else 1 - self.lights[name]

    def set_lights_of_ring(self, number: int, action: int) -> None:
        """Switches one of the ring, or all for any other number."""
        for each in [number] if 0 <= number < RING else range(RING):
            self.set_ring(each, action)

    def play(self, number: int) -> None:
        """Plays a sound from 1 to 5; another number stops it."""
        self.sound = number if 1 <= number <= 5 else 0

    # Sensors

    def background(self, level: int, channels: int) -> list[int]:
        """Returns readings of ``channels`` sensors around ``level``, with noise."""
        return self._background(level, channels)

    def proximity(self) -> list[int]:
        """12 bits, calibrated, larger is nearer: (0.5 m / range) squared."""
        ranges = (distance(sensor, self._pose, self.walls) for sensor in SENSORS)
        seen = [round(min(4095.0, (0.5 / max(metres, 0.001)) ** 2)) for metres in ranges]
        return [max(pair) for pair in zip(self._background(4, len(SENSORS)), seen, strict=True)]

    def ambient(self) -> list[int]:
        """Returns the ambient light of the proximity sensors."""
        return self._background(3700, len(SENSORS))

    def acceleration(self) -> list[int]:
        """Returns raw x, y and z; z contains gravity."""
        sideways, ahead, up = self._background(-3, 3)
        return [sideways, ahead, 16384 + up]

    def spherical(self) -> list[float]:
        """Acceleration, orientation and inclination, in degrees."""
        sideways, ahead, up = self.acceleration()
        inclination = math.degrees(math.atan2(math.hypot(sideways, ahead), up))
        return [math.hypot(sideways, ahead, up), math.degrees(math.atan2(sideways, ahead)), inclination]

    def rotation(self) -> list[int]:
        """Returns raw x, y and z of the gyroscope."""
        x, y, z = self._background(-3, 3)
        return [x, y, z + round(math.degrees(self.chassis.omega) / self.turn_unit)]

    def floor(self, sensors: int) -> list[int]:
        """Returns the readings of the ground sensors."""
        return self._background(900, sensors)

    # Camera

    @property
    def image_size(self) -> int:
        """The bytes of an image with the present settings."""
        mode, width, height, _ = self.image_settings
        return wrap(width * height * (1 if mode == 0 else 2), 16)

    def set_images(self, parameters: str) -> None:
        """Sets the camera; settings that exceed its memory become the smallest image."""
        scan(parameters, self.image_settings, self.int_bits)
        if not 0 < self.image_size <= MEMORY_FOR_IMAGES:
            self.image_settings[:3] = [1, 40, 40]

    def image(self) -> bytes:
        """Mode, width and height, then a gradient that moves from image to image."""
        self._images += 1
        return bytes(value & 0xFF for value in self.image_settings[:3]) + bytes(
            (self._images + index) & 0xFF for index in range(self.image_size)
        )


def acknowledged(letter: str, act: Callable[[EPuckBody, str], None]) -> Callable[[EPuckBody, str], bytes]:
    """Returns a text command that calls ``act`` and replies with its letter."""

    def answer(robot: EPuckBody, parameters: str) -> bytes:
        act(robot, parameters)
        return reply(letter)

    return answer
