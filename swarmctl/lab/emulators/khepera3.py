"""The Khepera III (K-Team): typed arguments, ``$`` for errors, and a timestamp in its measurements."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from swarmctl.lab.emulators.differential_drive import Chassis, Sensor, clamp, distance, wrap
from swarmctl.lab.emulators.robot import LineRobot, reply

WHEEL_DIAMETER = 0.041
TOP_SPEED = 0.2986  # what the speed regulator reaches, m/s
TOP_SPEED_OPEN_LOOP = 0.3333
LEAST_SPEED = 0.01388  # what the regulator can hold, m/s: below it the wheel stands
PROFILE_SPEED = 15000  # for going to a position, until J says otherwise
BRAITENBERG_SPEED = 5120  # with nothing in sight
MOST_ARGUMENTS = 4
LONGEST_ARGUMENT = 9


@dataclass(frozen=True)
class Firmware:
    """What differs between the firmwares: the scale of speeds and of position counters."""

    revision: tuple[int, int]
    units_per_metre_per_second: float
    counts_per_turn: float


FIRMWARES = {
    2: Firmware(revision=(2, 1), units_per_metre_per_second=144_010.0, counts_per_turn=2764.8),
    3: Firmware(revision=(3, 0), units_per_metre_per_second=218_720.0, counts_per_turn=4198.4),
}

SENSORS = (
    Sensor(-0.038, 0.048, 128.0),
    Sensor(0.019, 0.064, 75.0),
    Sensor(0.050, 0.050, 42.0),
    Sensor(0.070, 0.017, 13.0),
    Sensor(0.070, -0.017, -13.0),
    Sensor(0.050, -0.050, -42.0),
    Sensor(0.019, -0.064, -75.0),
    Sensor(-0.038, -0.048, -128.0),
    Sensor(-0.048, 0.0, 180.0),
)
GROUND_SENSORS = 2
ULTRASOUND = tuple(Sensor(0.0, 0.0, heading) for heading in (90.0, 45.0, 0.0, -45.0, -90.0))
ULTRASOUND_REACH = 4.0
BACKGROUND = 2.4  # range of the echo without a wall, m

US_MASK, IR_MASK = 0, 4
LIGHTS = ("led0", "led1")
CAPACITY = 1350  # of the battery, mAh
EMPTY, FULL = 64_000, 84_000  # of the battery, in 0.1 mV

LEADING_NUMBER = re.compile(r"\s*([+-]?[0-9]+)")


def leading_number(text: str) -> int:
    """Returns the number at the start of ``text``, else 0, like C's atoi."""
    match = LEADING_NUMBER.match(text)
    return wrap(int(match[1]), 32) if match else 0


def typed(argument: str) -> int:
    """An argument with a type letter: its first character is blanked unseen, so ``-100`` is read as 100."""
    return leading_number(" " + argument[1:])


def plain(argument: str) -> int:
    """An argument read by its type letter: ``l`` for 32 bits, ``d`` for 16, none for 8."""
    if argument[:1] in ("l", "d"):
        return wrap(leading_number(argument[1:]), 32 if argument[0] == "l" else 16)
    return wrap(leading_number(argument), 8)


class Khepera3(LineRobot):
    """Khepera III, ``firmware`` 2 or 3, alone or with K-Team's ``server`` on its KoreBot in between.

    Command letters are capitals; ``z`` acknowledges ``Z``. The server throws away whatever has arrived when
    an answer leaves, and blanks the first character of an argument that has a type. How the bare robot
    takes an argument without its type letter is not documented; here it has 8 bits then.
    """

    type_name: ClassVar[str] = "khepera3"
    refusal = b"$\r\n"
    longest_line: ClassVar[int] = 82

    def __init__(
        self,
        *,
        firmware: int = 2,
        server: bool = True,
        wheel_separation: float = 0.0884,
    ) -> None:
        if firmware not in FIRMWARES:
            raise ValueError(f"a khepera3 has firmware 2 or 3, not {firmware!r}")
        self.firmware = FIRMWARES[firmware]
        self.server = server
        self._typed = typed if server else plain
        super().__init__(
            Chassis(
                wheel_separation=wheel_separation,
                metres_per_count=math.pi * WHEEL_DIAMETER / self.firmware.counts_per_turn,
                counter_bits=32,
            )
        )
        self.lights = dict.fromkeys(LIGHTS, 0)
        self._set_defaults()
        self._handlers: dict[str, tuple[int, Callable[..., bytes]]] = {
            "A": (1, self._braitenberg_mode),
            "B": (0, lambda: reply("b", *self.firmware.revision)),
            "C": (2, self._configure),
            "D": (2, self._set_speed),
            "E": (0, lambda: reply("e", *self._speeds())),
            "F": (2, self._go_to_with_profile),
            "G": (1, self._ultrasound),
            "H": (4, lambda *_: reply("h")),
            "I": (2, self._set_counters),
            "J": (2, self._set_profile),
            "K": (2, self._set_led),
            "L": (2, self._open_loop),
            "M": (0, self._initialise_motors),
            "N": (0, lambda: reply("n", *self._proximity(), self._timestamp())),
            "O": (0, lambda: reply("o", *self._ambient(), self._timestamp())),
            "P": (2, self._go_to),
            "R": (0, lambda: reply("r", *self._counters())),
            "V": (1, self._battery),
            "X": (0, self._everything),
            "Z": (0, self._reset_timestamp),
        }

    def _set_defaults(self) -> None:
        self._braitenberg = False
        self._profile_speed = PROFILE_SPEED
        self._settings = {US_MASK: 4, 1: 3, IR_MASK: -1, 5: 12, 6: 1}
        self._time_zero = self.chassis.time

    def replies(self, data: bytes) -> list[bytes]:
        if not self.server:
            return super().replies(data)
        for byte in data:
            answer = self._push(byte)
            if answer is not None:
                return [answer]
        return []

    def answer(self, line: str) -> bytes:
        arguments = [argument for argument in line[2:].split(",") if argument][:MOST_ARGUMENTS]
        if line[0] not in self._handlers:
            return self.refusal
        arity, handler = self._handlers[line[0]]
        if len(arguments) < arity or any(len(argument) > LONGEST_ARGUMENT for argument in arguments):
            return self.refusal
        return handler(*arguments[:arity])

    def power_cycle(self) -> bytes:
        self._set_defaults()
        return super().power_cycle()

    # Motion

    def _metres_per_second(self, units: int, top: float, least: float = 0.0) -> float:
        scale = self.firmware.units_per_metre_per_second
        return clamp(units, round(top * scale)) / scale if abs(units) >= round(least * scale) else 0.0

    def _drive(self, left: int, right: int, top: float, least: float = 0.0) -> None:
        if not self._braitenberg:  # the loop of that mode sets the wheels anew every 20 ms
            speeds = [self._metres_per_second(units, top, least) for units in (left, right)]
            self.chassis.drive(*speeds)

    def _set_speed(self, left: str, right: str) -> bytes:
        self._drive(self._typed(left), self._typed(right), TOP_SPEED, LEAST_SPEED)
        return reply("d")

    def _open_loop(self, left: str, right: str) -> bytes:
        self._drive(self._typed(left), self._typed(right), TOP_SPEED_OPEN_LOOP)
        return reply("l")

    def _move(self, left: str, right: str, speed: float) -> None:
        if not self._braitenberg:
            for wheel, target in zip(self.chassis.wheels, (left, right), strict=True):
                wheel.go_to(self._typed(target), speed)

    def _go_to_with_profile(self, left: str, right: str) -> bytes:
        self._move(left, right, self._metres_per_second(self._profile_speed, TOP_SPEED, LEAST_SPEED))
        return reply("f")

    def _go_to(self, left: str, right: str) -> bytes:
        self._move(left, right, TOP_SPEED)
        return reply("p")

    def _set_profile(self, speed: str, _: str) -> bytes:
        self._profile_speed = self._typed(speed)
        return reply("j")

    def _initialise_motors(self) -> bytes:
        self._drive(0, 0, TOP_SPEED)
        self._profile_speed = PROFILE_SPEED
        return reply("m")

    def _braitenberg_mode(self, mode: str) -> bytes:
        """0 and 1 drive on as with nothing in sight (turning away is not emulated); only 2 ends it."""
        number = leading_number(mode)
        if number not in (0, 1, 2):
            return self.refusal
        speed = BRAITENBERG_SPEED if number != 2 else 0
        if number != 2 or self._braitenberg:
            self._braitenberg = False
            self._drive(speed, speed, TOP_SPEED)
        self._braitenberg = number != 2
        return reply("a")

    def _set_counters(self, left: str, right: str) -> bytes:
        self.chassis.left.count, self.chassis.right.count = self._typed(left), self._typed(right)
        return reply("i")

    def _speeds(self) -> list[int]:
        return [
            round(wheel.speed * self.firmware.units_per_metre_per_second) for wheel in self.chassis.wheels
        ]

    def _counters(self) -> list[int]:
        return [wheel.count for wheel in self.chassis.wheels]

    def _set_led(self, led: str, state: str) -> bytes:
        number, action = leading_number(led), leading_number(state)
        if number in (0, 1):
            name = LIGHTS[number]
            self.lights[name] = action if action in (0, 1) else 1 - self.lights[name]
        return reply("k")

    # Sensors

    def _proximity(self) -> list[int]:
        """12 bits, larger is nearer: 3960 at 2 cm. The two on the ground look at a bright floor."""
        ranges = (distance(sensor, self._pose, self.walls) for sensor in SENSORS)
        seen = [round(3960 * math.exp(-30 * max(0.0, metres - 0.02))) for metres in ranges]
        around = [max(pair) for pair in zip(self._background(40, len(SENSORS)), seen, strict=True)]
        return around + self._background(3100, GROUND_SENSORS)

    def _ambient(self) -> list[int]:
        return self._background(2800, len(SENSORS) + GROUND_SENSORS)

    def _timestamp(self) -> int:
        return round((self.chassis.time - self._time_zero) * 1000) % (1 << 32)

    def _reset_timestamp(self) -> bytes:
        self._time_zero = self.chassis.time
        return reply("z")

    def _configure(self, index: str, value: str) -> bytes:
        self._settings[wrap(leading_number(index), 16)] = wrap(self._typed(value), 16)
        return reply("c")

    def _ultrasound(self, number: str) -> bytes:
        """Distances in cm. A sensor outside the mask has no echo; one without a wall has the background's."""
        sensor = leading_number(number) - 1
        if not 0 <= sensor < len(ULTRASOUND):
            return self.refusal
        noise = self._background(3, len(ULTRASOUND))[sensor]
        if not self._settings[US_MASK] >> sensor & 1:
            return reply("g", 0, *[0] * 15, noise)
        metres = distance(ULTRASOUND[sensor], self._pose, self.walls)
        centimetres = round(100 * (metres if metres <= ULTRASOUND_REACH else BACKGROUND)) + noise % 2
        return reply("g", 1, centimetres, 40_000 // (100 + centimetres), self._timestamp(), *[0] * 12, noise)

    def _battery(self, quantity: str) -> bytes:
        ripple = self._background(0, 6)
        charge = EMPTY + round((FULL - EMPTY) * self.battery) + ripple[0]
        values: dict[int, tuple[int | str, ...]] = {
            0: divmod(charge, 10_000),
            1: (-312 - ripple[1], 5000),
            2: (-305 - ripple[2], 5000),
            3: (f"{round(CAPACITY * self.battery) + ripple[3]:03d}",),
            4: (27, 1000 * ripple[4]),
            5: (round(100 * self.battery),),
        }
        number = leading_number(quantity)
        return reply("v", *values[number]) if number in values else self.refusal

    def _everything(self) -> bytes:
        """The binary block of 67 bytes: proximity, ambient light, speeds, counters, timestamp."""
        readings = struct.pack("<22H", *self._proximity(), *self._ambient())
        motion = struct.pack("<4iI", *self._speeds(), *self._counters(), self._timestamp())
        return b"x" + readings + motion + b"\n\r"
