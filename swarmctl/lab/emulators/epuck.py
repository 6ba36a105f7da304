"""The e-puck (GCtronic firmware, hardware 1.3)."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import ClassVar

from swarmctl.lab.emulators.epuck_body import RING, EPuckBody
from swarmctl.lab.emulators.epuck_commands import BINARIES, PAYLOADS, TEXTS, WELCOME, low16
from swarmctl.lab.emulators.robot import reply

OVER_BLUETOOTH, OVER_SECOND_LINE = 3, 10
EMPTY, FULL = 2070, 2560  # of the battery, 3.4 V and 4.2 V
SOUND_SAMPLES = 600
VERSION = b"v,Version 1.2.2 August 2008 GCtronic\r\nHW version: FFFF\r\n"


class EPuck(EPuckBody):
    """e-puck (version 1) with GCtronic's firmware: text and binary, 16-bit numbers and step counters."""

    type_name: ClassVar[str] = "epuck"
    int_bits: ClassVar[int] = 16
    top_speed: ClassVar[int] = 1000
    protocol_positions: ClassVar[frozenset[int]] = frozenset({OVER_BLUETOOTH, OVER_SECOND_LINE})
    turn_unit: ClassVar[float] = 0.00875  # LSM330 at 250 degrees per second
    payloads: ClassVar[Mapping[str, int]] = PAYLOADS

    def __init__(self, *, wheel_separation: float = 0.053, selector: int = OVER_BLUETOOTH) -> None:
        super().__init__(wheel_separation=wheel_separation, counter_bits=16, selector=selector)
        self.lights = dict.fromkeys([*(f"led{number}" for number in range(RING)), "body", "front"], 0)

    def banner(self) -> bytes:
        """Returns the text that the robot sends when it starts."""
        return b"Selector pos %d\r\n" % self._runs + (WELCOME if self.runs_protocol else b"")

    def set_ring(self, number: int, action: int) -> None:
        """Switches a LED of the ring."""
        self.set_light(f"led{number}", action)

    @property
    def battery_raw(self) -> int:
        """The raw reading of the battery."""
        return EMPTY + round((FULL - EMPTY) * self.battery)

    def seen(self) -> list[int]:
        """Returns the proximity values of text replies: on the second serial line there are two more."""
        return self.proximity() + (self.background(4, 2) if self._runs == OVER_SECOND_LINE else [])

    def reset(self) -> bytes:
        """Restarts the robot; returns the reply."""
        return reply("r") + self.power_cycle()

    texts: ClassVar[Mapping[str, Callable[..., bytes]]] = {
        **TEXTS,
        "b": lambda robot, _: reply("b", f"{robot.battery_raw} ({round(100 * robot.battery)}%)"),
        "N": lambda robot, _: reply("n", *robot.seen()),
        "R": lambda robot, _: robot.reset(),
        "V": lambda robot, _: VERSION,
    }

    def set_speeds(self, payload: bytes) -> bytes:
        """Sets both speeds from a binary payload."""
        self.speeds[:] = struct.unpack("<2h", payload)
        self.take_up_speeds()
        return b""

    binaries: ClassVar[Mapping[str, Callable[..., bytes]]] = {
        **BINARIES,
        "b": lambda robot, _: struct.pack("<H", robot.battery_raw),
        "D": set_speeds,
        "M": lambda robot, _: low16(robot.floor(5)),
        "t": lambda robot, _: struct.pack("<b", 24),
        "U": lambda robot, _: bytes(robot.background(128, SOUND_SAMPLES)),
    }
