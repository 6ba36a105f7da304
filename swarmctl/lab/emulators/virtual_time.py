"""A robot's line in virtual time, for deterministic tests."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from swarmctl.lab.emulators.line_output import Line, Pieces
from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.serial_faults import Faults


class VirtualPort:
    """Like ``Port``, but without a pty and without waiting: time passes only in ``advance``."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.plugged = True
        self.time = 0.0
        self._line = Line(robot)
        self._stuck = b""  # bytes that a stuck robot has not taken
        self._waiting: deque[tuple[float, bytes]] = deque()

    @property
    def faults(self) -> Faults:
        """The faults that the line injects."""
        return self._line.faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        self._line.faults = faults
        self.write(b"")

    def write(self, data: bytes) -> None:
        """Writes ``data`` as the host. Without a cable it is lost."""
        if not self.plugged:
            return
        if self.faults.stuck:
            self._stuck += data
            return
        data, self._stuck = self._stuck + data, b""
        for answer in self.robot.replies(data) if data else ():
            self._put(self._line.sent(answer, self.robot.refusal))

    def advance(self, dt: float) -> bytes:
        """Runs for ``dt`` seconds; returns what the host receives, and what was due before."""
        end = self.time + dt
        while (due := max(0.0, self.robot.unsolicited_due())) <= end - self.time:
            output = self.robot.run_for(due)
            self.time += due
            for frame in output:
                self._put(self._line.sent(frame))
        self.robot.run_for(end - self.time)
        self.time = end
        received = bytearray()
        while self._waiting and self._waiting[0][0] <= self.time:
            received += self._waiting.popleft()[1]
        return bytes(received)

    def ask(self, request: bytes) -> bytes:
        """Writes ``request``; returns what is received at once."""
        self.write(request)
        return self.advance(0.0)

    def plug(self) -> None:
        """Connects the cable."""
        self.plugged = True

    def unplug(self) -> None:
        """Unplugs the cable; bytes in transit are lost."""
        self.plugged = False
        self._waiting.clear()

    def power_cycle(self) -> None:
        """Switches the robot off and on: it stops, resets, and prints its banner."""
        self._put([(0.0, self.robot.power_cycle())])

    @contextmanager
    def now(self) -> Iterator[Robot]:
        """Yields the robot in its current state, to read or change it."""
        yield self.robot

    def _put(self, pieces: Pieces | None) -> None:
        if pieces is None:
            self.unplug()
        if not self.plugged or pieces is None:
            return
        due = self.time
        for wait, data in pieces:
            due += wait
            self._waiting.append((due, data))
