"""The e-puck2 (firmware of 2018): the e-puck's protocol on 32 bits, and all sensors at once."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from typing import ClassVar

from swarmctl.lab.emulators.differential_drive import Sensor, distance, wrap
from swarmctl.lab.emulators.epuck_body import RING, EPuckBody
from swarmctl.lab.emulators.epuck_commands import BINARIES, PAYLOADS, TEXTS, WELCOME, low16
from swarmctl.lab.emulators.robot import reply

OVER_BLUETOOTH, OVER_USB = 3, 8
EMPTY, FULL = 2785, 3441  # of the battery, 3.4 V and 4.2 V
INTENSITY = 10  # of a coloured light that text switches on, of 100
COLOURED = (1, 3, 5, 7)  # of the ring; they are LED2, 4, 6 and 8 on the robot
COLOURS = ("red", "green", "blue")
AHEAD = Sensor(0.035, 0.0, 0.0)
LONGEST_RANGE, NOTHING_IN_RANGE = 2.0, 8190  # of the time-of-flight sensor, m and mm
FIELD = (22.0, -42.0)  # of the Earth, level and up, microtesla
TEMPERATURE = 31  # inside, in degrees
VERSION = b"v,Version 2.0 January 2018 GCtronic\r\nHW version: FFFF\r\n"

ALL_SENSORS, ALL_ACTUATORS, ALL_COLOURS, BUTTON, MICROPHONES, RANGE, CARD = map(chr, range(0x08, 0x0F))
MAGNETOMETER_ON, PROXIMITY_ON, RANGE_ON = map(chr, range(0x0F, 0x12))
STEPS_FLAG = 0x04


class EPuck2(EPuckBody):
    """e-puck2: text, and binary with all sensors in one answer; a reset command that is not answered."""

    type_name: ClassVar[str] = "epuck2"
    int_bits: ClassVar[int] = 32
    top_speed: ClassVar[int] = 1100
    protocol_positions: ClassVar[frozenset[int]] = frozenset({OVER_BLUETOOTH, OVER_USB, 15})
    turn_unit: ClassVar[float] = 1 / 131  # MPU-9250 at 250 degrees per second
    payloads: ClassVar[Mapping[str, int]] = {
        **PAYLOADS,
        ALL_ACTUATORS: 19, ALL_COLOURS: 12, MAGNETOMETER_ON: 1, PROXIMITY_ON: 1, RANGE_ON: 1,
    }  # fmt: skip

    def __init__(self, *, wheel_separation: float = 0.053, selector: int = OVER_BLUETOOTH) -> None:
        super().__init__(wheel_separation=wheel_separation, counter_bits=32, selector=selector)
        plain = [f"led{number}" for number in range(RING) if number not in COLOURED]
        coloured = [f"led{number}_{colour}" for number in COLOURED for colour in COLOURS]
        self.lights = dict.fromkeys([*plain, *coloured, "body", "front"], 0)

    def banner(self) -> bytes:
        """Returns the text that the robot sends when it starts."""
        return WELCOME if self.runs_protocol else b""

    def set_ring(self, number: int, action: int) -> None:
        """A toggle of a coloured light changes only its red."""
        if number not in COLOURED:
            self.set_light(f"led{number}", action)
        elif action in (0, 1):
            self.set_colour(number, (action * INTENSITY, 0, 0))
        else:
            self.lights[f"led{number}_red"] = 0 if self.lights[f"led{number}_red"] else INTENSITY

    def set_colour(self, number: int, levels: tuple[int, ...]) -> None:
        """Sets the three colours of a LED."""
        for colour, level in zip(COLOURS, levels, strict=True):
            self.lights[f"led{number}_{colour}"] = level

    def set_colours(self, levels: bytes) -> bytes:
        """Sets all coloured LEDs from a binary payload."""
        for index, number in enumerate(COLOURED):
            self.set_colour(number, tuple(levels[3 * index : 3 * index + 3]))
        return b""

    @property
    def battery_raw(self) -> int:
        """The raw reading of the battery."""
        return EMPTY + round((FULL - EMPTY) * self.battery)

    def range_ahead(self) -> int:
        """Returns the reading of the time-of-flight sensor, mm."""
        metres = distance(AHEAD, self._pose, self.walls)
        return round(1000 * metres) if metres <= LONGEST_RANGE else NOTHING_IN_RANGE

    def field(self) -> list[float]:
        """Returns the reading of the magnetometer in the Earth's field, microtesla."""
        level, up = FIELD
        theta = self.chassis.theta
        return [level * math.cos(theta), -level * math.sin(theta), up]

    def all_sensors(self) -> bytes:
        """103 bytes; the ones in the middle are memory card, remote control (3) and selector."""
        return b"".join(
            (
                low16(self.acceleration()),
                struct.pack("<3f", *self.spherical()),
                low16(self.rotation()),
                struct.pack("<3f", *self.field()),
                struct.pack("<b", TEMPERATURE),
                low16(self.proximity()),
                low16(self.ambient()),
                low16([self.range_ahead(), *self.background(14, 4), *self.steps(), self.battery_raw]),
                bytes([0, 0, 0, 0, self.selector]),
                low16(self.floor(3)),
                low16(self.floor(3)),
                b"\0",
            )
        )

    def all_actuators(self, payload: bytes) -> bytes:
        """Flags, left and right (speeds or, by a flag, steps), plain lights, colours, sound."""
        flags, left, right, lights = struct.unpack("<BHHB", payload[:6])
        self.speeds[:] = left, right
        if flags & STEPS_FLAG:
            self.set_steps([wrap(value, 16) for value in self.speeds])
        else:
            self.take_up_speeds()
        for bit, name in enumerate(("led0", "led2", "led4", "led6", "body", "front")):
            self.set_light(name, lights >> bit & 1)
        self.set_colours(payload[6:18])
        for bit in range(6):  # the sixth stops; of several the last one counts
            if payload[18] >> bit & 1:
                self.play(bit + 1)
        return b""

    def set_speeds(self, payload: bytes) -> bytes:
        """The firmware decodes the bytes without their sign; E returns them like that."""
        self.speeds[:] = struct.unpack("<2H", payload)
        self.take_up_speeds()
        return b""

    texts: ClassVar[Mapping[str, Callable[..., bytes]]] = {
        **TEXTS,
        "b": lambda robot, _: reply("b", f"{robot.battery_raw} ({round(100 * robot.battery)}%)"),
        "R": lambda robot, _: b"",
        "V": lambda robot, _: VERSION,
    }

    binaries: ClassVar[Mapping[str, Callable[..., bytes]]] = {
        **BINARIES,
        ALL_SENSORS: lambda robot, _: robot.all_sensors(),
        ALL_ACTUATORS: all_actuators,
        ALL_COLOURS: set_colours,
        BUTTON: lambda robot, _: b"\0",
        MICROPHONES: lambda robot, _: low16(robot.background(14, 4)),
        RANGE: lambda robot, _: low16([robot.range_ahead()]),
        CARD: lambda robot, _: b"\0",
        MAGNETOMETER_ON: lambda robot, _: b"\0",
        PROXIMITY_ON: lambda robot, _: b"\0",
        RANGE_ON: lambda robot, _: b"\0",
        "b": lambda robot, _: struct.pack("<H", robot.battery_raw),
        "D": set_speeds,
        "M": lambda robot, _: low16(robot.floor(4)),
        "t": lambda robot, _: b"\0",  # the firmware asks the sensor only where there is none
    }
