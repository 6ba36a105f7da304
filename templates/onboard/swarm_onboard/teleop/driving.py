"""The command loop of a teleop program: one command per period; at its end, every driven robot is stopped."""

from __future__ import annotations

import signal
import threading
import time
from dataclasses import dataclass
from types import FrameType
from typing import Callable, Optional, Tuple

ZEROS = 5  # a stop is sent so often, since one may be lost; then others may command


@dataclass(frozen=True)
class Twist:
    """A command: m/s forward, rad/s to the left."""

    linear: float
    angular: float


STOP = Twist(0.0, 0.0)
Commands = Tuple[Tuple[int, Twist], ...]


class Fanout:
    """One command for many robots, by their index."""

    def __init__(self, robots: int) -> None:
        self._zeros_due = [0] * robots

    def step(self, wanted: Twist | None, chosen: int | None = None) -> Commands:
        """Returns the commands of this tick. ``chosen`` is the robot that is driven, None for all of them."""
        commands = []
        for robot, due in enumerate(self._zeros_due):
            if wanted is not None and chosen in (None, robot):
                self._zeros_due[robot] = ZEROS
                commands.append((robot, wanted))
            elif due:
                self._zeros_due[robot] = due - 1
                commands.append((robot, STOP))
        return tuple(commands)

    @property
    def silent(self) -> bool:
        """Whether every robot that was driven has been stopped."""
        return not any(self._zeros_due)


_SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
_LAST_WORDS = 3.0  # s that others wait for the stop

Wanted = Tuple[Optional[Twist], Optional[int]]


class EndedError(BaseException):
    """A request to end before the program drives. Not an Exception, so that no library catches it."""


class Ending:
    """A request to end, from a signal or from ROS. The loop stops driven robots first."""

    def __init__(self) -> None:
        self.requested = False
        self._driving = False
        self._stopped = threading.Event()
        self._stopped.set()
        for number in _SIGNALS:
            signal.signal(number, self._signalled)

    def begin(self) -> None:
        """Records that robots may move from now on."""
        self._stopped.clear()
        self._driving = True

    def done(self) -> None:
        """Records that the robots were sent a stop and that nothing moves them again."""
        self.requested = True
        self._stopped.set()

    def end_and_wait(self) -> None:
        """Requests the end and returns once the robots were sent a stop; for another thread."""
        self.requested = True
        self._stopped.wait(_LAST_WORDS)

    def _signalled(self, _number: int, _frame: FrameType | None) -> None:
        early = not self.requested and not self._driving
        self.requested = True
        if early:
            raise EndedError


def drive(
    fanout: Fanout,
    ending: Ending,
    look: Callable[[], Wanted],
    send: Callable[[Commands], None],
    rest: Callable[[float], None],
    *,
    period: float,
) -> None:
    """Sends commands until ``ending`` is requested or a call raises, then stops. ``rest`` takes seconds."""
    ending.begin()
    try:
        due = time.monotonic()
        while not ending.requested:
            send(fanout.step(*look()))
            due = max(due + period, time.monotonic())  # a beat that was missed is not made up for
            while not ending.requested and time.monotonic() < due:
                rest(max(0.0, due - time.monotonic()))
    finally:
        while not fanout.silent:
            send(fanout.step(None))
            time.sleep(period)  # ROS sends in threads of its own: the last word gets time as well
        ending.done()
