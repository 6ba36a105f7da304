"""What every emulated robot is: bytes in, bytes out, and wheels that keep turning until told to stop."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

from swarmctl.lab.emulators.motion import Chassis
from swarmctl.lab.emulators.world import Wall, ripple

TERMINATORS = b"\r\n"


@dataclass(frozen=True)
class State:
    """The truth about a robot, in SI units; ``theta`` is not wrapped, ``distance`` is the length of the path.

    ``commands`` counts complete requests, refused ones too; ``last_command`` is the latest, binary as hex.
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


class Robot(ABC):
    """One robot without clock or wire: ``receive`` bytes, ``live`` some time, see its ``state``.

    A robot that speaks unasked tells when by ``unasked_due``; see ``NoticesPort`` for one that notices when
    its port is opened.
    """

    type_name: ClassVar[str]
    refusal: ClassVar[bytes]  # what it answers to a request it does not understand

    def __init__(self, chassis: Chassis, walls: Sequence[Wall] = ()) -> None:
        self.chassis = chassis
        self.walls = tuple(walls)
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
            left=chassis.left.speed,
            right=chassis.right.speed,
            v=chassis.v,
            omega=chassis.omega,
            distance=chassis.distance,
            commands=self._commands,
            last_command=self._last_command,
        )

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

    longest_line: ClassVar[int]

    def __init__(self, chassis: Chassis, walls: Sequence[Wall] = ()) -> None:
        super().__init__(chassis, walls)
        self._line = bytearray()

    @abstractmethod
    def answer(self, line: str) -> bytes:
        """The reply to one request, terminator included."""

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


def reply(letter: str, *values: int | str) -> bytes:
    """``letter`` and its values, comma separated, ended with CR LF as all three robots do."""
    return ",".join([letter, *map(str, values)]).encode("ascii") + b"\r\n"
