"""Passes velocity commands to the thread that executes them: the latest one, and a socket that wakes it."""

from __future__ import annotations

import contextlib
import math
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
        self.refused = 0
        self._listen, self._bell = socket.socketpair()
        self._bell.setblocking(False)

    def put(self, linear: Sequence[float], angular: Sequence[float], arrived: float | None = None) -> None:
        """Stores a Twist: its components x, y, z in m/s and rad/s. An implausible one makes it a stop.

        Ignored while the robot is held.
        """
        if self.held:
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


class DeadMan:
    """Holds a command in force for ``timeout`` seconds after it arrived, then lets the robot stand.

    Ignores a command from before the dead-man's own beginning: it was meant for another moment.
    """

    def __init__(self, commands: CommandMailbox, timeout: float, clock: Callable[[], float]) -> None:
        self.since = clock()
        self._commands = commands
        self.timeout = timeout
        self._clock = clock

    def in_force(self) -> Command | None:
        """Returns the latest command; None once it has expired."""
        return self._given() if self._clock() < self.due() else None

    def due(self) -> float:
        """Returns the moment at which the latest command expires."""
        command = self._given()
        return command.stamp + self.timeout if command is not None else -math.inf

    def expired(self) -> bool:
        """Returns True if the robot stands for want of commands, and not because it is held."""
        return not self._commands.held and self.in_force() is None

    def activity(self, moving: bool) -> str:
        """Returns what the robot is doing, as text for people."""
        if self._commands.held:
            return "stopped by `swarmctl stop`: commands are ignored until `swarmctl start`"
        if self.in_force() is not None:
            return "driving" if moving else "standing still, as commanded"
        silence = "yet" if self._given() is None else f"for {self.timeout:g} s"
        return f"standing still: no accepted command {silence}"

    def _given(self) -> Command | None:
        command = self._commands.latest if not self._commands.held else None
        return command if command is not None and command.stamp >= self.since else None
