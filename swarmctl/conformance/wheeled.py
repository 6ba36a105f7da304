"""What checks of motion need of a robot on the bench, whatever it speaks."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from swarm_driver.config import Config
from swarm_driver.link import BytePort
from swarm_driver.own import InterruptionError
from swarm_driver.relay import Outgoing, Parameter, Relay
from swarm_rosserial.topics import MessageType


class NotStoppedError(Exception):
    """Nobody knows whether the robot stands."""


class TooLongError(InterruptionError):
    """A protocol's class does not come back. Not an Exception, so that the class cannot catch it."""


class BreakOffError(InterruptionError):
    """Somebody ends the test by a signal."""


@dataclass(frozen=True)
class Pace:
    """Seconds to reach a speed, to measure it, to wait whether a robot stops by itself; how often to ask.

    ``patience``: for a board to announce its topics.
    """

    settle: float = 0.5
    measure: float = 0.8
    silence: float = 2.5
    questions: int = 50
    patience: float = 20.0


@dataclass(frozen=True)
class Motion:
    """Speeds of the left and the right wheel, m/s: as they were ordered, and as the counters have it."""

    ordered: tuple[float, float]
    measured: tuple[float, float]
    resolution: float  # m/s that one count makes


@dataclass(frozen=True)
class Mends:
    """What to mend where counters stand, sides are swapped, a wheel goes the wrong way, or the speed is off
    by a factor.
    """

    still: str
    swapped: str
    wrong: str
    off: Callable[[float], str]


class Wheeled(Protocol):
    """A robot that can be driven and measured. ``said`` is an order in what the robot is told."""

    config: Config
    pace: Pace
    clock: Callable[[], float]
    sleep: Callable[[float], None]
    open_port: Callable[[], BytePort]
    relay: Relay  # for a whole driver at work
    reply_timeout: float

    @property
    def mends(self) -> Mends: ...

    @property
    def counts(self) -> bool:
        """Whether it has position counters."""
        ...

    def connect(self) -> None: ...

    def disconnect(self) -> None:
        """Let go of the line as a killed driver does: without a word."""
        ...

    def stop(self) -> int:
        """Have the robot stand; the attempts it took. ``LinkLostError`` if it does not."""
        ...

    def leave(self) -> None:
        """The last word is a stop. ``NotStoppedError`` if nobody knows whether it helped."""
        ...

    def driving(self, linear: float, angular: float) -> AbstractContextManager[Any]:
        """Moving for a while, and standing after it, whatever happens. Gives what is ``said``."""
        ...

    def go_on(self, said: Any, seconds: float) -> None:
        """Keep a speed up, as a driver does."""
        ...

    def motion(self, linear: float, angular: float) -> Motion:
        """Drive so for a while, and compare what was said with what the counters tell."""
        ...

    def speed_said(self, linear: float) -> tuple[bytes, str] | None:
        """What goes out for a speed straight ahead, m/s, and how people read it; nothing where it is not the
        same each time.
        """
        ...

    def harmless(self) -> Callable[[bytes], bool]:
        """Tells what goes out and sets no speed."""
        ...


class NoBoard:
    """The topics of a board that is none, or that nobody listens to."""

    def type_of(self, name: str) -> MessageType | None:
        return None

    def serve(self, topics: object) -> None: ...

    def publish(self, topic: object, message: bytes) -> None: ...

    def log(self, level: int, text: str) -> None: ...

    def ask(self, name: str) -> None: ...

    def taken(self) -> list[Outgoing | Parameter]:
        return []
