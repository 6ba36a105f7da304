"""A robot under test on its port: what checks need of it, whatever its protocol."""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from swarm_onboard.driver.config import Config
from swarm_onboard.driver.kinematics import Pose, within_limits
from swarm_onboard.driver.link import BytePort, LinkLostError
from swarm_onboard.driver.port import Port, PortError
from swarm_onboard.driver.user_codec import InterruptionError

from swarmctl.conformance.timed_port import TimedPort

Velocity = tuple[float, float]  # m/s forward, rad/s to the left
Reading = tuple[float, Pose]  # s by the bench's clock, and the paths of the wheels
STANDSTILL: Velocity = (0.0, 0.0)
_ANY = 10.0  # times the top speed
_SLOW = 0.3  # of the top speed


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


class Bench(ABC):
    """A robot that can be driven and measured. Use of the line raises ``LinkLostError`` and ``PortError``.

    ``clock`` and ``sleep`` may be those of an emulated board.
    """

    has_counters: bool  # whether the robot reports how far its wheels have turned
    port: TimedPort  # the latest one
    reply_timeout = 0.0  # s

    def __init__(
        self,
        config: Config,
        pace: Pace,
        open_port: Callable[[], BytePort] | None = None,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.config, self.pace = config, pace
        self.clock, self.sleep = clock, sleep
        self.open_port = open_port or (lambda: Port(config.port, config.serial))
        self.commanded_at = -math.inf
        built = config.kinematics
        #: Odometry takes a wheel far beyond its limit for a reset robot; here it must be measured.
        self.any_speed = replace(built, wheel_speed_max=_ANY * built.wheel_speed_max)
        self._open = False

    @property
    @abstractmethod
    def fixes(self) -> Fixes:
        """The texts that explain failed motion checks."""

    @property
    @abstractmethod
    def metres_per_count(self) -> float:
        """The distance of a wheel per count, m."""

    @property
    def slow_speed(self) -> float:
        """A slow forward speed that the wheels can reach, m/s."""
        built = self.config.kinematics
        return max(_SLOW * min(built.linear_max, built.wheel_speed_max), built.wheel_speed_min)

    def connect(self) -> None:
        """Opens the port, unless it is open."""
        if not self._open:
            self.port = TimedPort(self.open_port(), self.clock)
            self._open = True
            self._connected()

    def disconnect(self) -> None:
        """Closes the port without a stop, like a killed driver."""
        if self._open:
            self._open = False
            self.port.close()

    def finish(self) -> None:
        """Stops the robot and closes the port. Raises ``NotStoppedError`` if the stop may have failed."""
        try:
            self._stop_finally()
        except (LinkLostError, PortError) as error:
            raise NotStoppedError(str(error)) from error
        finally:
            self.disconnect()

    @contextmanager
    def driving(self, linear: float, angular: float = 0.0) -> Iterator[Velocity]:
        """Drives at a velocity (m/s, rad/s) within the limits while entered; stops the robot at the end."""
        velocity = within_limits(linear, angular, self.config.kinematics)
        try:
            self.command(velocity)
            yield velocity
        finally:
            self.stop()

    def measured(self, velocity: Velocity) -> Motion:
        """Returns the speeds that result from a command, without limiting it."""
        self.hold(velocity, self.pace.settle)
        before = self.position(velocity)
        self.hold(velocity, self.pace.measure)
        after = self.position(velocity)
        resolution = self.metres_per_count / (after[0] - before[0])
        return Motion(self.wheel_speeds(velocity), speeds_between(before, after), resolution)

    @abstractmethod
    def command(self, velocity: Velocity) -> None:
        """Sends a velocity."""

    @abstractmethod
    def hold(self, velocity: Velocity, seconds: float) -> None:
        """Repeats a command for a while, as a driver does."""

    @abstractmethod
    def stop(self) -> int:
        """Stops the robot; returns the number of attempts. Raises ``LinkLostError`` if it does not stop."""

    @abstractmethod
    def position(self, velocity: Velocity | None = None) -> Reading:
        """Returns the next reading of the counters; repeats the command until then, if there is one."""

    @abstractmethod
    def wheel_speeds(self, velocity: Velocity) -> tuple[float, float]:
        """Returns the speeds of the left and right wheel, m/s, that a command asks for."""

    @abstractmethod
    def encoded_speed(self, linear: float) -> tuple[bytes, str] | None:
        """Returns the bytes of a speed straight ahead (m/s) and a readable form; None if they vary."""

    @abstractmethod
    def is_harmless(self) -> Callable[[bytes], bool]:
        """Returns a predicate that is true of bytes that move no wheel."""

    @abstractmethod
    def _connected(self) -> None:
        """Begins to speak to the robot on ``port``, which has just been opened."""

    @abstractmethod
    def _stop_finally(self) -> None:
        """Stops the robot at the end of the test, whatever has happened to the line."""


def speeds_between(before: Reading, after: Reading) -> tuple[float, float]:
    """Returns the speeds of the left and right wheel between two readings, m/s."""
    (began, first), (ended, last) = before, after
    seconds = ended - began
    return (last.left - first.left) / seconds, (last.right - first.right) / seconds
