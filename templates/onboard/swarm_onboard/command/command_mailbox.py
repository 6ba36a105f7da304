"""Passes velocity commands to the thread that executes them: the latest one, and a socket that wakes it."""

from __future__ import annotations

import contextlib
import select
import socket
import time
from dataclasses import dataclass
from typing import Any, Callable, Sequence

from swarm_onboard.command.limits import STANDSTILL, Velocity, plausible


@dataclass(frozen=True)
class Command:
    """A velocity. ``stamp`` is its arrival, on the monotonic clock."""

    velocity: Velocity
    stamp: float


class CommandMailbox:
    """Holds one command, never a queue: a command that was overtaken is not worth executing.

    ``put``, ``stop`` and ``wait`` may run in different threads: each sets one attribute and rings a socket.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.latest: Command | None = None
        self.commanded_at = clock()  # when the latest command came, or the mailbox was made
        self.stopped = False
        self.held = False
        self.battery_empty = False
        self.refused = 0
        self._listen, self._bell = socket.socketpair()
        self._bell.setblocking(False)

    def put(self, linear: Sequence[float], angular: Sequence[float], arrived: float | None = None) -> None:
        """Stores a Twist: its components x, y, z in m/s and rad/s. An implausible one makes it a stop.

        Ignored while the robot is held or its battery is empty.
        """
        if self.closed:
            return
        sane = plausible((*linear, *angular))
        self.refused += not sane
        stamp = self._clock() if arrived is None else arrived
        self.commanded_at = stamp
        self.latest = Command(Velocity(*linear, *angular) if sane else STANDSTILL, stamp)
        self.ring()

    def hold(self, *, held: bool) -> None:
        """Makes the robot stand until it is released; commands from before the release are dropped."""
        if held != self.held:
            self.latest = None
            self.held = held

    def hold_empty(self, *, empty: bool) -> None:
        """Makes the robot stand for an empty battery, as ``hold`` does."""
        self.latest = None
        self.battery_empty = empty
        self.ring()

    @property
    def closed(self) -> bool:
        """Whether the robot stands, whatever it is commanded."""
        return self.held or self.battery_empty

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
