"""The beat of a program: asked each period what is wanted, and however it ends, who was driven is stopped."""

from __future__ import annotations

import signal
import threading
import time
from types import FrameType
from typing import Callable, Optional, Tuple

from swarm_teleop.fanout import Fanout, Orders, Twist

_SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
_LAST_WORDS = 3.0  # s that others wait for the stop

Wanted = Tuple[Optional[Twist], Optional[int]]


class EndedError(BaseException):
    """Somebody wants the program to end before it drives. Not an Exception, so that no library takes it."""


class Ending:
    """Asked to end, by a signal or by ROS. Where robots may be driven the loop stops them first."""

    def __init__(self) -> None:
        self.asked = False
        self._driving = False
        self._stopped = threading.Event()
        self._stopped.set()
        for number in _SIGNALS:
            signal.signal(number, self._signalled)

    def begin(self) -> None:
        """From now on robots may move."""
        self._stopped.clear()
        self._driving = True

    def done(self) -> None:
        """The robots have been told to stop; nothing moves them again."""
        self.asked = True
        self._stopped.set()

    def end_and_wait(self) -> None:
        """For another thread: ask, and come back when the robots have been told to stop."""
        self.asked = True
        self._stopped.wait(_LAST_WORDS)

    def _signalled(self, _number: int, _frame: FrameType | None) -> None:
        early = not self.asked and not self._driving
        self.asked = True
        if early:
            raise EndedError


def drive(
    fanout: Fanout,
    ending: Ending,
    look: Callable[[], Wanted],
    tell: Callable[[Orders], None],
    rest: Callable[[float], None],
    *,
    period: float,
) -> None:
    """Until ``ending`` is asked for, or something fails. ``rest`` waits so many seconds, or less."""
    ending.begin()
    try:
        due = time.monotonic()
        while not ending.asked:
            tell(fanout.step(*look()))
            due = max(due + period, time.monotonic())  # a beat that was missed is not made up for
            while not ending.asked and time.monotonic() < due:
                rest(max(0.0, due - time.monotonic()))
    finally:
        while not fanout.silent:
            tell(fanout.step(None))
            time.sleep(period)  # ROS sends in threads of its own: the last word gets time as well
        ending.done()
