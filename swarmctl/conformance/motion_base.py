"""What motion checks need of a robot under test, whatever its protocol."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from swarm_onboard.driver.config import Config
from swarm_onboard.driver.link import BytePort
from swarm_onboard.driver.relay import Outgoing, Parameter, Relay
from swarm_onboard.driver.user_codec import InterruptionError
from swarm_onboard.rosserial.topics import MessageType


class NotStoppedError(Exception):
    """The robot may still be moving."""


class HangError(InterruptionError):
    """A user's codec hangs. Not an ``Exception``, so that the codec does not catch it."""


class AbortError(InterruptionError):
    """The test is ended by a signal."""


@dataclass(frozen=True)
class Pace:
    """Seconds to reach a speed, to measure it, and to wait for a stop without commands; number of queries.

    ``patience``: seconds for a board to announce its topics.
    """

    settle: float = 0.5
    measure: float = 0.8
    silence: float = 2.5
    questions: int = 50
    patience: float = 20.0


@dataclass(frozen=True)
class Motion:
    """Speeds of the left and right wheel, m/s: as commanded and as measured by the counters."""

    commanded: tuple[float, float]
    measured: tuple[float, float]
    resolution: float  # m/s that one count makes


@dataclass(frozen=True)
class Fixes:
    """What to do if counters stand, sides are swapped, a wheel turns the wrong way, or a speed is off by a
    factor.
    """

    still: str
    swapped: str
    wrong: str
    off: Callable[[float], str]


class Wheeled(Protocol):
    """A robot that can be driven and measured. A ``command`` is in the units of its protocol."""

    config: Config
    pace: Pace
    clock: Callable[[], float]
    sleep: Callable[[float], None]
    open_port: Callable[[], BytePort]
    relay: Relay  # for a whole driver
    reply_timeout: float

    @property
    def fixes(self) -> Fixes:
        """The texts that explain failed checks."""

    @property
    def has_counters(self) -> bool:
        """Whether it has position counters."""
        ...

    def connect(self) -> None:
        """Opens the port, unless it is open."""

    def disconnect(self) -> None:
        """Closes the port without a stop, like a killed driver."""
        ...

    def stop(self) -> int:
        """Stops the robot; returns the number of attempts. Raises ``LinkLostError`` if it does not stop."""
        ...

    def finish(self) -> None:
        """Stops the robot and closes the port. Raises ``NotStoppedError`` if the stop may have failed."""
        ...

    def driving(self, linear: float, angular: float) -> AbstractContextManager[Any]:
        """Drives inside the block and stops afterwards, whatever happens. Yields the command."""
        ...

    def hold(self, command: Any, seconds: float) -> None:
        """Repeats a command for a while, as a driver does."""
        ...

    def motion(self, linear: float, angular: float) -> Motion:
        """Drives for a while and returns the commanded and measured speeds."""
        ...

    def encoded_speed(self, linear: float) -> tuple[bytes, str] | None:
        """Returns the bytes of a speed straight ahead (m/s) and a readable form; None if they vary."""
        ...

    def is_harmless(self) -> Callable[[bytes], bool]:
        """Returns a test for bytes that set no speed."""
        ...


class NoBoard:
    """A relay without topics."""

    def type_of(self, name: str) -> MessageType | None:
        """Returns None: no type is known."""
        return None

    def serve(self, topics: object) -> None:
        """Ignored."""

    def publish(self, topic: object, message: bytes) -> None:
        """Ignored."""

    def log(self, level: int, text: str) -> None:
        """Ignored."""

    def ask(self, name: str) -> None:
        """Ignored."""

    def taken(self) -> list[Outgoing | Parameter]:
        """Returns nothing: no message comes from ROS."""
        return []
