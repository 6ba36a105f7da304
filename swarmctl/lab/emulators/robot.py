"""The base classes of emulated robots: bytes in, bytes out, wheels that turn until a stop command."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from random import Random
from typing import ClassVar, Protocol, runtime_checkable

from swarmctl.lab.emulators.differential_drive import Chassis, Wall, ripple
from swarmctl.lab.emulators.serial_faults import Faults

TERMINATORS = b"\r\n"


@dataclass(frozen=True)
class State:
    """The true state of a robot, in SI units; ``theta`` is not wrapped, ``distance`` is the length of the
    path.

    ``commands`` counts complete requests, refused ones too; ``last_command`` is the latest, binary as hex.
    ``lights`` are the levels by name, 0 is off. ``sound`` is the number of the sound that plays, 0 is none.
    """

    x: float
    y: float
    theta: float
    left: float
    right: float
    v: float
    omega: float
    distance: float
    commands: int
    last_command: str
    battery: float = 1.0
    lights: dict[str, int] = field(default_factory=dict)
    sound: int = 0


AT_REST = State(
    x=0.0, y=0.0, theta=0.0, left=0.0, right=0.0, v=0.0, omega=0.0, distance=0.0, commands=0, last_command=""
)


class Robot(ABC):
    """One robot without a clock or a line: ``receive`` bytes, ``run_for`` seconds, read its ``state``.

    A robot with unsolicited output overrides ``unsolicited_due`` and ``unsolicited``; ``NoticesPort`` is for
    one that notices when its port is opened.
    """

    type_name: ClassVar[str]
    refusal: bytes = b""  # its answer to an invalid request
    uses_rosserial: ClassVar[bool] = False  # has frames, which have faults of their own
    changeable: ClassVar[Mapping[str, type]] = {"battery": float}  # settings that may change while it runs

    def __init__(self, chassis: Chassis) -> None:
        self.chassis = chassis
        self.walls: tuple[Wall, ...] = ()
        self.lights: dict[str, int] = {}
        self.sound = 0
        self._charge = 0.8
        self._commands = 0
        self._last_command = ""
        self._samples = 0

    @abstractmethod
    def replies(self, data: bytes) -> list[bytes]:
        """Takes raw bytes in any pieces and returns the answers to the requests they complete."""

    def receive(self, data: bytes) -> bytes:
        """Returns ``replies`` joined."""
        return b"".join(self.replies(data))

    def banner(self) -> bytes:
        """Returns what the robot prints when it is switched on."""
        return b""

    def power_cycle(self) -> bytes:
        """Switches the robot off and on: wheels stand, counters and settings are reset.

        Returns the banner.
        """
        self.chassis.power_cycle()
        self.lights = dict.fromkeys(self.lights, 0)
        self.sound = 0
        return self.banner()

    def advance(self, dt: float) -> None:
        """Moves the robot for ``dt`` seconds."""
        self.chassis.advance(dt)

    def unsolicited_due(self) -> float:
        """Returns the seconds until the next unsolicited output; infinite if there is none."""
        return math.inf

    def unsolicited(self) -> list[bytes]:
        """Returns the unsolicited output that is due (``unsolicited_due`` is 0) and schedules the next."""
        return []

    def run_for(self, dt: float) -> list[bytes]:
        """Runs the robot for ``dt`` seconds and returns its unsolicited output.

        Raises ``RuntimeError`` if it never stops sending.
        """
        output: list[bytes] = []
        while (due := max(0.0, self.unsolicited_due())) <= dt:
            self.advance(due)
            dt -= due
            output += self.unsolicited()
            if self.unsolicited_due() <= 0.0:
                raise RuntimeError(f"{type(self).__name__}.unsolicited_due() is still 0 after unsolicited()")
        self.advance(dt)
        return output

    @property
    def state(self) -> State:
        """The true pose and wheel speeds, in metres and radians."""
        chassis = self.chassis
        return State(
            x=chassis.x,
            y=chassis.y,
            theta=chassis.theta,
            left=chassis.distance_scale * chassis.left.speed,
            right=chassis.distance_scale * chassis.right.speed,
            v=chassis.v,
            omega=chassis.omega,
            distance=chassis.distance,
            commands=self._commands,
            last_command=self._last_command,
            battery=self.battery,
            lights=dict(self.lights),
            sound=self.sound,
        )

    @property
    def battery(self) -> float:
        """The charge, 0 to 1. Setting it raises ``ValueError`` out of range."""
        return self._charge

    @battery.setter
    def battery(self, level: float) -> None:
        if not 0.0 <= level <= 1.0:
            raise ValueError(f"'battery' is between 0 (empty) and 1 (full), not {level!r}")
        self._charge = level

    def corrupt(self, frame: bytes, faults: Faults, random: Random) -> bytes:
        """Returns ``frame`` with the faults that are specific to the robot's protocol."""
        return frame

    @property
    def _pose(self) -> tuple[float, float, float]:
        return self.chassis.x, self.chassis.y, self.chassis.theta

    def _note(self, command: str) -> None:
        self._commands += 1
        self._last_command = command

    def _background(self, level: int, channels: int) -> list[int]:
        """Returns readings of ``channels`` sensors near ``level``; each call differs a little."""
        self._samples += 1
        return [level + ripple(channel, self._samples) for channel in range(channels)]


@runtime_checkable
class NoticesPort(Protocol):
    """A robot that notices when its port is opened, as an Arduino UNO, which is reset by it."""

    def opened(self) -> None:
        """A program has opened the port."""

    def closed(self) -> None:
        """The port is closed again."""


class LineRobot(Robot):
    """A robot with a line protocol: a request ends with CR or LF, empty lines are ignored."""

    longest_line: ClassVar[int] = 128

    def __init__(self, chassis: Chassis) -> None:
        super().__init__(chassis)
        self._line = bytearray()

    @abstractmethod
    def answer(self, line: str) -> bytes:
        """Returns the reply to one request, terminator included."""

    def replies(self, data: bytes) -> list[bytes]:
        return [answer for byte in data if (answer := self._push(byte)) is not None]

    def power_cycle(self) -> bytes:
        self._line.clear()
        return super().power_cycle()

    def _push(self, byte: int) -> bytes | None:
        """Takes one byte; returns the answer if a request is complete.

        A line that is too long counts as complete.
        """
        if byte not in TERMINATORS:
            self._line.append(byte)
            if len(self._line) < self.longest_line:
                return None
        if not self._line:
            return None
        line = self._line.decode("latin-1")
        self._line.clear()
        self._note(line)
        return self.answer(line)


def reply(letter: str, *values: int | str, end: bytes = b"\r\n") -> bytes:
    """Returns ``letter`` and its values, separated by commas."""
    return ",".join([letter, *map(str, values)]).encode("ascii") + end


class SilentRobot(Robot):
    """Takes every byte and stands still."""

    type_name = "silent"

    def __init__(self) -> None:
        super().__init__(Chassis(wheel_separation=1.0, metres_per_count=1.0, counter_bits=32))

    def replies(self, data: bytes) -> list[bytes]:
        return []
