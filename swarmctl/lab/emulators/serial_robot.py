"""A robot on a serial line: the pty that it answers on, and the clock that it moves by."""

from __future__ import annotations

import inspect
import math
import os
import select
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType

from swarmctl.lab.emulators.line_output import Line
from swarmctl.lab.emulators.pty import Cable
from swarmctl.lab.emulators.robot import AT_REST, NoticesPort, Robot, State
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.user_robot import describe_error

PTMX = Path("/dev/ptmx")
MAX_LAG = 0.25  # s that unsolicited output may be late; a slow machine would fall behind more and more
POLL_PERIOD = 0.02  # s, for robots that notice their port: a pty reports a close, not an open


@dataclass(frozen=True, kw_only=True)
class Snapshot(State):
    """The robot's true state, whether its cable is plugged in, and the exception of a user's robot."""

    plugged: bool
    failure: str | None


class Port:
    """One robot and its cable. The robot moves by the monotonic clock, whether it is plugged in or not.

    Its motion is computed exactly and on demand, so an idle port uses no CPU unless the robot has unsolicited
    output or notices its port. A robot with unsolicited output runs slower on a machine that is too slow.
    ``faults`` may be set at any time.
    """

    def __init__(self, robot: Robot, ptmx: Path = PTMX) -> None:
        self.robot = robot
        self._ptmx = ptmx
        self._lock = threading.RLock()
        self._moved_at = time.monotonic()
        self._cable: Cable | None = None
        self._is_open = False  # as last reported to the robot
        self._thread: threading.Thread | None = None
        self._line = Line(robot)
        self._state = AT_REST  # the latest
        self.failure: str | None = None  # the exception of a user's robot, which has ended then

    @property
    def faults(self) -> Faults:
        """The faults that the line injects."""
        return self._line.faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        with self._lock:
            self._line.faults = faults
            self._wake()  # a stuck robot may take its bytes now

    @property
    def path(self) -> Path | None:
        """The path of the slave while the cable is plugged in."""
        cable = self._cable
        return cable.path if cable else None

    def plug(self) -> Path:
        """Plugs the cable in, as a new pty unless it is in already. Returns the path of the slave."""
        if self._cable is None and self._thread:
            self._thread.join()  # it may still be closing a cable that vanished
        with self._lock:
            if self._cable is None:
                self._cable = Cable(self._ptmx)
                self._thread = threading.Thread(target=self._serve, args=(self._cable,), daemon=True)
                self._thread.start()
            return self._cable.path

    def unplug(self) -> None:
        """Unplugs the cable: readers get a hangup, the robot keeps executing its last command."""
        with self._lock:
            thread = self._thread
            self._unplug()
        if thread and thread is not threading.current_thread():
            thread.join()

    def _unplug(self) -> None:
        """Unplugs without waiting for the serving thread, which ends by itself."""
        cable, self._cable = self._cable, None
        if cable:
            cable.pulled = True
            os.eventfd_write(cable.wake, 1)

    close = unplug

    def __enter__(self) -> Port:
        self.plug()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def snapshot(self) -> Snapshot:
        """Returns the robot's current state."""
        with self._lock:
            self._catch_up()
            with self._guarded():
                self._state = self.robot.state
            return Snapshot(**asdict(self._state), plugged=self._cable is not None, failure=self.failure)

    def power_cycle(self) -> None:
        """Switches the robot off and on: it stops, resets, and prints its banner."""
        with self.now() as robot, self._guarded():
            self.send(robot.power_cycle())

    @contextmanager
    def now(self) -> Iterator[Robot]:
        """Yields the robot in its current state, to read or change it."""
        with self._lock:
            self._catch_up()
            yield self.robot
            self._wake()

    def send(self, data: bytes) -> None:
        """Makes the robot send ``data`` without a request. Faults do not apply."""
        with self._lock:
            if self._cable:
                self._cable.put([(0.0, data)])
                self._wake()

    def _wake(self) -> None:
        if self._cable:
            os.eventfd_write(self._cable.wake, 1)

    def _catch_up(self) -> None:
        """Runs the robot until now; its unsolicited output is sent, or lost without a cable."""
        now = time.monotonic()
        lag = math.inf if self._cable is None else self._due() + MAX_LAG  # unplugged, lag does not matter
        with self._guarded():
            for frame in self.robot.run_for(min(now - self._moved_at, lag)):
                self._answer(frame)
        self._moved_at = now

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        """Catches any exception of a user's robot: it is recorded and the cable is unplugged for good."""
        try:
            yield
        except BaseException as error:  # sys.exit() too
            if isinstance(error, KeyboardInterrupt) and _signals_come_here():
                raise
            self.failure = self.failure or describe_error(error, inspect.getfile(type(self.robot)))
            self._unplug()

    def _answer(self, answer: bytes, refusal: bytes | None = None) -> None:
        """Sends ``answer`` with the faults applied. Unsolicited output has no ``refusal``."""
        if self._cable is None:
            return
        pieces = self._line.sent(answer, refusal)
        if pieces is None:
            self._unplug()
        else:
            self._cable.put(pieces)

    def _serve(self, cable: Cable) -> None:
        # Edge-triggered: a closed port is reported once, not for ever.
        with select.epoll() as events:
            events.register(cable.master, select.EPOLLIN | select.EPOLLOUT | select.EPOLLET)
            events.register(cable.wake, select.EPOLLIN | select.EPOLLET)
            while not cable.pulled:
                events.poll(self._wait_time(cable))
                with self._lock:
                    data = cable.ignore() if self.faults.stuck else cable.read()
                    self._notice(cable.is_open() or bool(data))
                    if data or self._due() < math.inf:
                        self._catch_up()
                    with self._guarded():
                        for answer in self.robot.replies(data) if data else ():
                            self._answer(answer, self.robot.refusal)
                    if not cable.pulled:
                        cable.write()
        self._notice(False)
        cable.close()

    def _wait_time(self, cable: Cable) -> float | None:
        """Returns the seconds until line or robot are due; None if that needs an event first."""
        with self._lock:
            due = self._due() - (time.monotonic() - self._moved_at)
        if isinstance(self.robot, NoticesPort) and not self._is_open:
            due = min(due, POLL_PERIOD)
        waiting = cable.wait_time()
        if waiting is not None:
            due = min(due, waiting)
        return max(0.0, due) if due < math.inf else None

    def _notice(self, is_open: bool) -> None:
        """Reports an opened or closed port to a robot that notices it."""
        with self._lock:
            if is_open == self._is_open:
                return
            self._is_open = is_open
            if isinstance(self.robot, NoticesPort):
                self._catch_up()
                with self._guarded():
                    self.robot.opened() if is_open else self.robot.closed()

    def _due(self) -> float:
        """Returns the seconds from the robot's time until its next unsolicited output."""
        with self._guarded():
            return self.robot.unsolicited_due()
        return math.inf


def _signals_come_here() -> bool:
    """Whether Ctrl-C is raised in this thread; elsewhere KeyboardInterrupt is raised by the robot itself."""
    return threading.current_thread() is threading.main_thread()
