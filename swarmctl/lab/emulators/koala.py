"""The classic Koala (K-Team): 16 infra-red sensors, speed in pulses per 10 ms, decimal ASCII lines."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import ClassVar

from swarmctl.lab.emulators.differential_drive import Chassis, Sensor, Wheel, clamp, distance
from swarmctl.lab.emulators.robot import LineRobot, reply

NUMBER = re.compile(r"[+-]?[0-9]{1,10}")

Handlers = Mapping[str, tuple[int, Callable[..., bytes]]]  # by letter: the count of numbers, and the function


def answered(handlers: Handlers, line: str, refusal: bytes) -> bytes:
    """Returns the reply to a line; ``refusal`` if letter, count or numbers are wrong."""
    letter, *fields = line.split(",")
    if letter not in handlers:
        return refusal
    arity, handler = handlers[letter]
    if len(fields) != arity or not all(NUMBER.fullmatch(field) for field in fields):
        return refusal
    return handler(*map(int, fields))


METRES_PER_PULSE = 0.045e-3
SPEED_UNIT = 4.5e-3  # one pulse per 10 ms, in m/s
TOP_SPEED = 127  # of the motors, in speed units
FULL_PWM = 255
PROFILE_SPEED = 20  # for going to a position, until J says otherwise

LEFT_SIDE = (
    Sensor(0.175, 0.015, 5.7),
    Sensor(0.169, 0.040, 11.5),
    Sensor(0.160, 0.070, 17.2),
    Sensor(0.140, 0.120, 45.8),
    Sensor(0.055, 0.140, 90.0),
    Sensor(-0.050, 0.140, 90.0),
    Sensor(-0.120, 0.125, 135.0),
    Sensor(-0.130, 0.0475, 180.0),
)
SENSORS = LEFT_SIDE + tuple(Sensor(sensor.x, -sensor.y, -sensor.heading) for sensor in LEFT_SIDE)

LIGHTS = ("led0", "led1")
EMPTY, FULL = 550, 650  # of the battery, in steps of 20 mV

SPEED_MODE, POSITION_MODE, PWM_MODE = 1, 0, 2


class Koala(LineRobot):
    """Koala (classic): decimal numbers between commas, ``z,Protocol error`` for an invalid request.

    No turret is fitted, so ``T`` is refused; the extension bus reads as it floats.
    """

    type_name: ClassVar[str] = "koala"
    refusal = b"z,Protocol error\r\n"

    def __init__(self, *, wheel_separation: float = 0.29) -> None:
        super().__init__(
            Chassis(wheel_separation=wheel_separation, metres_per_count=METRES_PER_PULSE, counter_bits=32)
        )
        self.lights = dict.fromkeys(LIGHTS, 0)
        self._mode = SPEED_MODE
        self._profile = (PROFILE_SPEED, PROFILE_SPEED)
        self._handlers: Handlers = {
            "A": (3, lambda *_: reply("a")),
            "B": (0, lambda: reply("b", "5.00", "1.00")),
            "C": (2, self._go_to),
            "D": (2, self._set_speed),
            "E": (0, lambda: reply("e", *(round(wheel.speed / SPEED_UNIT) for wheel in self.chassis.wheels))),
            "F": (3, lambda *_: reply("f")),
            "G": (2, self._set_counters),
            "H": (0, lambda: reply("h", *(wheel.count for wheel in self.chassis.wheels))),
            "I": (1, self._read_adc),
            "J": (4, self._set_profile),
            "K": (0, self._motion_status),
            "L": (2, self._set_led),
            "M": (1, self._measure),
            "N": (0, lambda: reply("n", *self._proximity())),
            "O": (0, lambda: reply("o", *self._background(700, len(SENSORS)))),
            "P": (2, self._set_pwm),
            "R": (1, lambda _: reply("r", 255)),
            "W": (2, lambda *_: reply("w")),
        }

    def answer(self, line: str) -> bytes:
        return answered(self._handlers, line, self.refusal)

    def power_cycle(self) -> bytes:
        self._mode = SPEED_MODE
        self._profile = (PROFILE_SPEED, PROFILE_SPEED)
        return super().power_cycle()

    def _set_speed(self, left: int, right: int) -> bytes:
        self._mode = SPEED_MODE
        self.chassis.drive(*(clamp(units, TOP_SPEED) * SPEED_UNIT for units in (left, right)))
        return reply("d")

    def _set_pwm(self, left: int, right: int) -> bytes:
        self._mode = PWM_MODE
        full_speed = TOP_SPEED * SPEED_UNIT
        self.chassis.drive(*(clamp(duty, FULL_PWM) / FULL_PWM * full_speed for duty in (left, right)))
        return reply("p")

    def _go_to(self, left: int, right: int) -> bytes:
        self._mode = POSITION_MODE
        for wheel, count, speed in zip(self.chassis.wheels, (left, right), self._profile, strict=True):
            wheel.go_to(count, clamp(speed, TOP_SPEED) * SPEED_UNIT)
        return reply("c")

    def _set_counters(self, left: int, right: int) -> bytes:
        self.chassis.left.count, self.chassis.right.count = left, right
        return reply("g")

    def _set_profile(self, speed_left: int, _: int, speed_right: int, __: int) -> bytes:
        self._profile = (speed_left, speed_right)
        return reply("j")

    def _motion_status(self) -> bytes:
        def status(wheel: Wheel) -> tuple[int, int, int]:
            return int(wheel.arrived), self._mode, 0

        return reply("k", *status(self.chassis.left), *status(self.chassis.right))

    def _set_led(self, led: int, action: int) -> bytes:
        if led not in (0, 1) or action not in (0, 1, 2):
            return self.refusal
        name = LIGHTS[led]
        self.lights[name] = action if action < 2 else 1 - self.lights[name]
        return reply("l")

    def _read_adc(self, channel: int) -> bytes:
        return reply("i", self._background(512, 8)[channel]) if 0 <= channel < 8 else self.refusal

    def _measure(self, quantity: int) -> bytes:
        """0 battery (20 mV), 1 total current (8 mA), 2 ambient temperature (0.1 degC), 3 and 4 motor currents
        (4 mA; a turning motor draws more), 5 battery temperature (0.1 degC).
        """
        draw = [20 + round(200 * abs(wheel.speed)) for wheel in self.chassis.wheels]
        quiet = [EMPTY + round((FULL - EMPTY) * self.battery), 40 + sum(draw) // 2, 235, *draw, 265]
        if not 0 <= quantity < len(quiet):
            return self.refusal
        return reply("m", quiet[quantity] + self._background(0, len(quiet))[quantity])

    def _proximity(self) -> list[int]:
        """10 bits, larger is nearer: 1023 at contact, lost in the background at about 0.5 m."""
        seen = (round(1023 * math.exp(-8 * distance(sensor, self._pose, self.walls))) for sensor in SENSORS)
        return [max(pair) for pair in zip(self._background(12, len(SENSORS)), seen, strict=True)]
