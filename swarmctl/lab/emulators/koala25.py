"""The Koala 2.5 (K-Team): not the classic Koala's letters, finer units, ultrasound, unsolicited reports."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

from swarmctl.lab.emulators.differential_drive import Chassis, Sensor, clamp, distance
from swarmctl.lab.emulators.koala import Handlers, answered
from swarmctl.lab.emulators.robot import LineRobot, reply

METRES_PER_PULSE = math.pi * 0.0825 / 23_400
SPEED_UNIT = METRES_PER_PULSE / 0.010  # one pulse per 10 ms, in m/s
TOP_SPEED = 516  # what the motors reach, in speed units
FULL_PWM = 2000
PROFILE = (5, 1, 10, 200, 10, 10)  # increment, divider, least and constant speed, margin, most current
IDLE, SPEED, RAMP, POSITION, OPEN_LOOP = range(5)  # the mode of a motor, as reported by Y
REFRESH = 0.1  # period of unsolicited reports, s

ULTRASOUND = (  # left rear, left front, front left, front, and so on clockwise
    Sensor(-0.12, 0.14, 90.0),
    Sensor(0.05, 0.14, 90.0),
    Sensor(0.14, 0.12, 45.0),
    Sensor(0.175, 0.0, 0.0),
    Sensor(0.14, -0.12, -45.0),
    Sensor(0.05, -0.14, -90.0),
    Sensor(-0.12, -0.14, -90.0),
    Sensor(-0.17, -0.06, 180.0),
    Sensor(-0.17, 0.06, 180.0),
)
NEAREST, FARTHEST = 25, 250  # cm
TOO_NEAR, NOTHING, DISABLED = 0, 1000, 2000
SAMPLES = 10  # of each axis, the newest first
G = 16_384
TURN_UNIT = 0.066  # degrees per second
FIELD = (220, -420)  # of the Earth, level and up, milligauss
EMPTY, FULL = 220, 270  # of the battery, in 0.1 V
NIMH = 1
NO_FIX = "V,00,0000.0000,N,00000.0000,E,00:00:00,00.00.00,0.0,0"
NMEA_NO_FIX = b"$GPRMC,,V,,,,,,,,,,N*53"
ENDS = {"cr": b"\r", "lf": b"\n"}


class Koala25(LineRobot):
    """Koala 2.5: its own letters, ultrasound, inertial sensors; a reply ends with one byte, ``cr`` or ``lf``.

    The manual's page on the protocol exchanges the codes of CR and LF, hence the choice. An
    invalid request is answered with ``#``, which the maker's library takes for an error.
    """

    type_name: ClassVar[str] = "koala-2.5"
    longest_line: ClassVar[int] = 1024

    def __init__(self, *, wheel_separation: float = 0.25, terminator: str = "cr") -> None:
        if terminator not in ENDS:
            raise ValueError(f"'terminator' is {' or '.join(ENDS)}, not {terminator!r}")
        super().__init__(
            Chassis(wheel_separation=wheel_separation, metres_per_count=METRES_PER_PULSE, counter_bits=32)
        )
        self._end = ENDS[terminator]
        self.refusal = b"#" + self._end
        self.lights = dict.fromkeys([f"power{number}" for number in range(4)], 0)
        self._set_defaults()
        self._handlers: Handlers = {
            "A": (1, self._set_reports),
            "B": (0, lambda: self._reply("b", "A-02")),
            "C": (2, self._configure),
            "D": (2, lambda left, right: self._drive("d", SPEED, left, right)),
            "E": (0, self._speeds),
            "F": (2, self._go_to),
            "G": (0, self._ultrasound),
            "H": (3, lambda *_: self._reply("h")),
            "I": (2, self._set_counters),
            "J": (6, self._set_profile),
            "K": (2, lambda left, right: self._drive("k", RAMP, left, right)),
            "L": (2, self._open_loop),
            "M": (0, self._acceleration),
            "N": (0, self._rotation),
            "O": (0, self._currents),
            "P": (0, lambda: self._reply("p", *(wheel.count for wheel in self.chassis.wheels))),
            "Q": (0, lambda: self._reply("q", NO_FIX)),
            "R": (3, lambda *request: self._reply("r", *[255] * clamp(request[2], 128))),
            "S": (5, self._set_outputs),
            "T": (0, lambda: self._reply("t", sum(on << bit for bit, on in enumerate(self._io)), 0)),
            "U": (0, lambda: self._reply("u", *self._background(512, 2))),
            "V": (0, self._battery_data),
            "Y": (0, self._motor_status),
            "Z": (0, lambda: self._reply("z") + self.power_cycle()),
            "&": (0, self._field),
            "?": (0, lambda: self._reply("!", 0)),
        }
        self._reports: dict[int, Callable[[], bytes]] = {
            0: self._ultrasound,
            1: self._speeds,
            2: lambda: self._reply("p", *(wheel.count for wheel in self.chassis.wheels)),
            3: self._currents,
            4: self._acceleration,
            5: self._rotation,
            6: lambda: self._reply("q", NO_FIX),
            7: lambda: NMEA_NO_FIX + self._end,
            8: self._field,
        }

    def _set_defaults(self) -> None:
        self._mask = 0  # of unsolicited reports
        self._report_at = math.inf
        self._us_mask = 511
        self._io = [0, 0, 0, 0]
        self._profile = PROFILE
        self._status = IDLE

    def _reply(self, letter: str, *values: int | str) -> bytes:
        return reply(letter, *values, end=self._end)

    def answer(self, line: str) -> bytes:
        if line.startswith("X,"):  # a command for the GPS, as text
            return self._reply("x")
        if line.startswith("W,") and len(fields := line.split(",")) > 3:  # address, register, data ...
            return self._reply("w") if all(field.isdecimal() for field in fields[1:]) else self.refusal
        return answered(self._handlers, line, self.refusal)

    def power_cycle(self) -> bytes:
        self._set_defaults()
        return super().power_cycle()

    # Unsolicited reports

    def _set_reports(self, mask: int) -> bytes:
        self._mask = mask
        self._report_at = self.chassis.time + REFRESH if mask & 0x1FF else math.inf
        return self._reply("a")

    def unsolicited_due(self) -> float:
        return self._report_at - self.chassis.time

    def unsolicited(self) -> list[bytes]:
        self._report_at += REFRESH
        return [report() for bit, report in self._reports.items() if self._mask >> bit & 1]

    # Motion

    def _drive(self, letter: str, status: int, left: int, right: int) -> bytes:
        """The ramp of K is shorter than a command period."""
        self._status = status
        self.chassis.drive(*(clamp(units, TOP_SPEED) * SPEED_UNIT for units in (left, right)))
        return self._reply(letter)

    def _open_loop(self, left: int, right: int) -> bytes:
        self._status = OPEN_LOOP
        full_speed = TOP_SPEED * SPEED_UNIT
        self.chassis.drive(*(clamp(duty, FULL_PWM) / FULL_PWM * full_speed for duty in (left, right)))
        return self._reply("l")

    def _go_to(self, left: int, right: int) -> bytes:
        self._status = POSITION
        for wheel, count in zip(self.chassis.wheels, (left, right), strict=True):
            wheel.go_to(count, clamp(self._profile[3], TOP_SPEED) * SPEED_UNIT)
        return self._reply("f")

    def _set_counters(self, left: int, right: int) -> bytes:
        """A move to a position is stopped: the target would have changed."""
        if self._status == POSITION:
            self.chassis.drive(0.0, 0.0)
        self.chassis.left.count, self.chassis.right.count = left, right
        return self._reply("i")

    def _set_profile(self, *values: int) -> bytes:
        self._profile = values[:6]  # type: ignore[assignment]
        return self._reply("j")

    def _speeds(self) -> bytes:
        return self._reply("e", *(round(wheel.speed / SPEED_UNIT) for wheel in self.chassis.wheels))

    def _motor_status(self) -> bytes:
        arrived = [int(self._status == POSITION and wheel.arrived) for wheel in self.chassis.wheels]
        return self._reply("y", self._status, self._status, *arrived)

    # Sensors and outputs

    def _configure(self, us_mask: int, _: int) -> bytes:
        self._us_mask = us_mask
        return self._reply("c")

    def _set_outputs(self, power: int, *levels: int) -> bytes:
        for bit in range(4):
            self.lights[f"power{bit}"] = power >> bit & 1
        self._io = [int(level == 1) for level in levels]
        return self._reply("s")

    def _ultrasound(self) -> bytes:
        return self._reply("g", *map(self._echo, range(len(ULTRASOUND))))

    def _echo(self, number: int) -> int:
        if not self._us_mask >> number & 1:
            return DISABLED
        centimetres = 100 * distance(ULTRASOUND[number], self._pose, self.walls)
        if centimetres > FARTHEST:
            return NOTHING
        return round(centimetres) if centimetres >= NEAREST else TOO_NEAR

    def _acceleration(self) -> bytes:
        noise = self._background(-3, 3 * SAMPLES)
        return self._reply("m", *(value + (G if index % 3 == 2 else 0) for index, value in enumerate(noise)))

    def _rotation(self) -> bytes:
        turning = round(math.degrees(self.chassis.omega) / TURN_UNIT)
        noise = self._background(-3, 3 * SAMPLES)
        return self._reply(
            "n", *(value + (turning if index % 3 == 2 else 0) for index, value in enumerate(noise))
        )

    def _currents(self) -> bytes:
        return self._reply("o", *(1 + round(10 * abs(wheel.speed)) for wheel in self.chassis.wheels))

    def _field(self) -> bytes:
        level, up = FIELD
        theta = self.chassis.theta
        return self._reply("@", round(level * math.cos(theta)), round(-level * math.sin(theta)), up)

    def _battery_data(self) -> bytes:
        """Kind, voltage (0.1 V), current (0.1 A), charging current (10 mA)."""
        draw = 5 + sum(1 + round(10 * abs(wheel.speed)) for wheel in self.chassis.wheels)
        return self._reply("v", NIMH, EMPTY + round((FULL - EMPTY) * self.battery), draw, 0)
