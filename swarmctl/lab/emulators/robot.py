"""What every emulated robot is: bytes in, bytes out, and wheels that keep turning until told to stop."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from random import Random
from typing import TYPE_CHECKING, ClassVar, Protocol, runtime_checkable

from swarmctl.lab.emulators.motion import Chassis
from swarmctl.lab.emulators.world import Wall, ripple

if TYPE_CHECKING:
    from swarmctl.lab.emulators.faults import Faults

TERMINATORS = b"\r\n"


@dataclass(frozen=True)
class State:
    """The truth about a robot, in SI units; ``theta`` is not wrapped, ``distance`` is the length of the path.

    ``commands`` counts complete requests, refused ones too; ``last_command`` is the latest, binary as hex.
    ``lights`` are what shines, and how: 0 is dark. ``sound`` is the number of the one that plays, 0 is none.
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
    """One robot without clock or wire: ``receive`` bytes, ``live`` some time, see its ``state``.

    A robot that speaks unasked tells when by ``unasked_due``; see ``NoticesPort`` for one that notices when
    its port is opened.
    """

    type_name: ClassVar[str]
    refusal: bytes = b""  # what it answers to a request it does not understand
    speaks_frames: ClassVar[bool] = False  # those of rosserial, which have faults of their own
    changeable: ClassVar[Mapping[str, type]] = {"battery": float}  # while it runs, with their kinds

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
        """Take raw bytes as they arrive, in any pieces; give the answers they complete, one per request."""

    def receive(self, data: bytes) -> bytes:
        """``replies`` as one run of bytes."""
        return b"".join(self.replies(data))

    def banner(self) -> bytes:
        """What the robot prints when it is switched on."""
        return b""

    def power_cycle(self) -> bytes:
        """Switch off and on: wheels stand, counters and settings are as new. Gives the banner."""
        self.chassis.power_cycle()
        self.lights = dict.fromkeys(self.lights, 0)
        self.sound = 0
        return self.banner()

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass."""
        self.chassis.advance(dt)

    def unasked_due(self) -> float:
        """Seconds until the robot wants to say something that nobody asked for; infinite if it never does."""
        return math.inf

    def unasked(self) -> list[bytes]:
        """What it wants to say now that ``unasked_due`` is 0; after that it is due later."""
        return []

    def live(self, dt: float) -> list[bytes]:
        """Let ``dt`` seconds pass; gives what the robot says unasked in them."""
        said: list[bytes] = []
        while (due := max(0.0, self.unasked_due())) <= dt:
            self.advance(due)
            dt -= due
            said += self.unasked()
            if self.unasked_due() <= 0.0:
                raise RuntimeError(f"{type(self).__name__}.unasked_due() is still 0 after unasked()")
        self.advance(dt)
        return said

    @property
    def state(self) -> State:
        chassis = self.chassis
        return State(
            x=chassis.x,
            y=chassis.y,
            theta=chassis.theta,
            left=chassis.stretch * chassis.left.speed,
            right=chassis.stretch * chassis.right.speed,
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
        """How full it is, 0 to 1."""
        return self._charge

    @battery.setter
    def battery(self, level: float) -> None:
        if not 0.0 <= level <= 1.0:
            raise ValueError(f"'battery' is between 0 (empty) and 1 (full), not {level!r}")
        self._charge = level

    def spoilt(self, frame: bytes, faults: Faults, random: Random) -> bytes:
        """``frame`` with the faults that only the robot's own protocol can have."""
        return frame

    @property
    def _pose(self) -> tuple[float, float, float]:
        return self.chassis.x, self.chassis.y, self.chassis.theta

    def _note(self, command: str) -> None:
        self._commands += 1
        self._last_command = command

    def _background(self, level: int, channels: int) -> list[int]:
        """A quiet reading of ``channels`` sensors around ``level``; the next one differs a little."""
        self._samples += 1
        return [level + ripple(channel, self._samples) for channel in range(channels)]


@runtime_checkable
class NoticesPort(Protocol):
    """A robot that notices when a program opens its port, as an Arduino UNO does, which is reset by it."""

    def opened(self) -> None:
        """A program has opened the port, which nobody had open."""

    def closed(self) -> None:
        """Nobody has the port open any more."""


class LineRobot(Robot):
    """A robot that speaks in lines: a request ends with CR or LF, empty lines are ignored."""

    longest_line: ClassVar[int] = 128

    def __init__(self, chassis: Chassis) -> None:
        super().__init__(chassis)
        self._line = bytearray()

    @abstractmethod
    def answer(self, line: str) -> bytes:
        """The reply to one request, terminator included."""

    def replies(self, data: bytes) -> list[bytes]:
        return [answer for byte in data if (answer := self._push(byte)) is not None]

    def power_cycle(self) -> bytes:
        self._line.clear()
        return super().power_cycle()

    def _push(self, byte: int) -> bytes | None:
        """Take one byte; the answer if it completed a request. A line too long is taken as it stands."""
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
    """``letter`` and its values, comma separated."""
    return ",".join([letter, *map(str, values)]).encode("ascii") + end
