"""Passes velocity commands to the thread that owns the line: the latest one, and a socket that wakes it."""

from __future__ import annotations

import contextlib
import math
import select
import socket
import time
from dataclasses import dataclass
from typing import Any, Callable, Sequence

from swarm_driver.kinematics import plausible


@dataclass(frozen=True)
class Command:
    """Drive so: m/s forward, rad/s to the left. ``stamp`` is when it arrived, on the monotonic clock."""

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
        """Take a Twist: x forward and z to the left count. A senseless component makes it a stop."""
        sane = plausible((*linear, *angular))
        self.refused += not sane
        stamp = self._clock() if arrived is None else arrived
        self.latest = Command(linear[0] if sane else 0.0, angular[2] if sane else 0.0, stamp)
        self.ring()

    def stop(self) -> None:
        """No more commands: whoever waits comes back to end."""
        self.stopped = True
        self.ring()

    def wait(self, seconds: float, others: Sequence[Any] = ()) -> None:
        """Sleep, but no longer than until somebody rings or one of ``others`` can be read."""
        ready, _, _ = select.select([self._listen, *others], [], [], max(0.0, seconds))
        if self._listen in ready:
            self._listen.recv(4096)

    def ring(self) -> None:
        """Wake who waits."""
        with contextlib.suppress(BlockingIOError):  # the bell is ringing already
            self._bell.send(b"!")


class DeadMan:
    """Holds a command in force for ``timeout`` seconds after it arrived, then lets the robot stand.

    A command from before the dead-man's own beginning was meant for another moment.
    """

    def __init__(self, commands: CommandMailbox, timeout: float, clock: Callable[[], float]) -> None:
        self.since = clock()
        self._commands = commands
        self._timeout = timeout
        self._clock = clock

    def in_force(self) -> Command | None:
        return self._given() if self._clock() < self.due() else None

    def due(self) -> float:
        """When the latest command is over."""
        command = self._given()
        return command.stamp + self._timeout if command is not None else -math.inf

    def activity(self, moving: bool) -> str:
        """What the robot is doing, in words."""
        if self.in_force() is not None:
            return "driving" if moving else "standing still, as commanded"
        silence = "no command yet" if self._given() is None else f"no command for {self._timeout:g} s"
        return f"standing still: {silence}"

    def _given(self) -> Command | None:
        command = self._commands.latest
        return command if command is not None and command.stamp >= self.since else None
