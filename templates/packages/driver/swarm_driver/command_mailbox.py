"""Passes velocity commands to the thread that owns the line: the latest one, and a socket that wakes it."""

from __future__ import annotations

import contextlib
import select
import socket
import time
from dataclasses import dataclass
from typing import Any, Callable, Sequence

from swarm_driver.kinematics import plausible


@dataclass(frozen=True)
class Command:
    """A velocity: m/s forward, rad/s to the left. ``stamp`` is its arrival, on the monotonic clock."""

    linear: float
    angular: float
    stamp: float


class CommandMailbox:
    """Holds one command, never a queue: a command that was overtaken is not worth executing.

    ``put``, ``stop`` and ``wait`` may run in different threads: each sets one attribute and rings a socket.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.latest: Command | None = None
        self.stopped = False
        self.refused = 0
        self._listen, self._bell = socket.socketpair()
        self._bell.setblocking(False)

    def put(self, linear: Sequence[float], angular: Sequence[float], arrived: float | None = None) -> None:
        """Stores a Twist: x forward and z to the left count. An implausible component makes it a stop."""
        sane = plausible((*linear, *angular))
        self.refused += not sane
        stamp = self._clock() if arrived is None else arrived
        self.latest = Command(linear[0] if sane else 0.0, angular[2] if sane else 0.0, stamp)
        self.ring()

    def stop(self) -> None:
        """Ends the mailbox: every waiting thread returns."""
        self.stopped = True
        self.ring()

    def wait(self, seconds: float, others: Sequence[Any] = ()) -> None:
        """Sleeps until the timeout, a ring, or input on one of ``others``."""
        ready, _, _ = select.select([self._listen, *others], [], [], max(0.0, seconds))
        if self._listen in ready:
            self._listen.recv(4096)

    def ring(self) -> None:
        """Wakes the waiting thread."""
        with contextlib.suppress(BlockingIOError):  # the bell is ringing already
            self._bell.send(b"!")
