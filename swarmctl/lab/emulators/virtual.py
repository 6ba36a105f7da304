"""A robot's line in virtual time: for tests that want the same bytes at the same moments every time."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from swarmctl.lab.emulators.faults import Faults
from swarmctl.lab.emulators.line import Line, Pieces
from swarmctl.lab.emulators.robot import Robot


class VirtualPort:
    """Does what ``Port`` does, without a pty and without waiting: time passes when ``advance`` says so."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.plugged = True
        self.time = 0.0
        self._line = Line(robot)
        self._stuck = b""  # what a robot that is stuck has not taken yet
        self._waiting: deque[tuple[float, bytes]] = deque()

    @property
    def faults(self) -> Faults:
        return self._line.faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        self._line.faults = faults
        self.write(b"")

    def write(self, data: bytes) -> None:
        """What the host writes. Without a cable it is lost."""
        if not self.plugged:
            return
        if self.faults.stuck:
            self._stuck += data
            return
        data, self._stuck = self._stuck + data, b""
        for answer in self.robot.replies(data) if data else ():
            self._put(self._line.sent(answer, self.robot.refusal))

    def advance(self, dt: float) -> bytes:
        """Let ``dt`` seconds pass; what the host hears in them, and what was due before."""
        end = self.time + dt
        while (due := max(0.0, self.robot.unasked_due())) <= end - self.time:
            said = self.robot.live(due)
            self.time += due
            for frame in said:
                self._put(self._line.sent(frame))
        self.robot.live(end - self.time)
        self.time = end
        heard = bytearray()
        while self._waiting and self._waiting[0][0] <= self.time:
            heard += self._waiting.popleft()[1]
        return bytes(heard)

    def ask(self, request: bytes) -> bytes:
        """Write ``request``; what is heard at once."""
        self.write(request)
        return self.advance(0.0)

    def plug(self) -> None:
        self.plugged = True

    def unplug(self) -> None:
        """What is on its way is lost."""
        self.plugged = False
        self._waiting.clear()

    def power_cycle(self) -> None:
        """Switch the robot off and on: it stands, forgets, and prints its banner."""
        self._put([(0.0, self.robot.power_cycle())])

    @contextmanager
    def now(self) -> Iterator[Robot]:
        """The robot as it is at this moment, to be looked at and changed."""
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
