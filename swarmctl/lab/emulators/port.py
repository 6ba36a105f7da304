"""A robot on a serial line: the pty it answers on, and the clock it moves by."""

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

from swarmctl.lab.emulators.cable import Cable
from swarmctl.lab.emulators.faults import Faults
from swarmctl.lab.emulators.line import Line
from swarmctl.lab.emulators.own import blame
from swarmctl.lab.emulators.robot import AT_REST, NoticesPort, Robot, State

PTMX = Path("/dev/ptmx")
MOST_OWED = (
    0.25  # s that a robot may be late with what it says; a machine too slow for it would owe ever more
)
LOOK_EVERY = 0.02  # for a robot that notices its port: a pty tells when it is closed, not when opened, s


@dataclass(frozen=True, kw_only=True)
class Snapshot(State):
    """The robot's true state at one moment, whether its cable is in, and what a robot of one's own raised."""

    plugged: bool
    failure: str | None


class Port:
    """One robot and its cable. The robot moves by the monotonic clock, plugged or not, watched or not.

    Its motion is worked out when somebody commands or asks, and exactly, so a port with a quiet line costs
    nothing unless the robot speaks unasked or notices who opens its port. A robot that speaks unasked loses
    time where the machine is too slow for it. ``faults`` may be set at any time.
    """

    def __init__(self, robot: Robot, ptmx: Path = PTMX) -> None:
        self.robot = robot
        self._ptmx = ptmx
        self._lock = threading.RLock()
        self._moved_at = time.monotonic()
        self._cable: Cable | None = None
        self._is_open = False  # as the robot was last told
        self._thread: threading.Thread | None = None
        self._line = Line(robot)
        self._state = AT_REST  # as it was last seen
        self.failure: str | None = None  # what a robot of one's own raised; it is dead then

    @property
    def faults(self) -> Faults:
        return self._line.faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        with self._lock:
            self._line.faults = faults
            self._wake()  # a robot that was stuck may take its bytes now

    @property
    def path(self) -> Path | None:
        """The slave's path while the cable is in."""
        cable = self._cable
        return cable.path if cable else None

    def plug(self) -> Path:
        """Put the cable in: a new pty. Gives the slave's path; the present one if the cable is in already."""
        if self._cable is None and self._thread:
            self._thread.join()  # it may still be putting away a cable that vanished
        with self._lock:
            if self._cable is None:
                self._cable = Cable(self._ptmx)
                self._thread = threading.Thread(target=self._serve, args=(self._cable,), daemon=True)
                self._thread.start()
            return self._cable.path

    def unplug(self) -> None:
        """Pull the cable out: readers are hung up on, the robot goes on as last told. Harmless when out."""
        with self._lock:
            thread = self._thread
            self._pull()
        if thread and thread is not threading.current_thread():
            thread.join()

    def _pull(self) -> None:
        """Take the cable away. The thread that serves it ends by itself."""
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
        """The robot's state now."""
        with self._lock:
            self._catch_up()
            with self._blamed():
                self._state = self.robot.state
            return Snapshot(**asdict(self._state), plugged=self._cable is not None, failure=self.failure)

    def power_cycle(self) -> None:
        """Switch the robot off and on: it stands, forgets, and prints its banner."""
        with self.now() as robot, self._blamed():
            self.send(robot.power_cycle())

    @contextmanager
    def now(self) -> Iterator[Robot]:
        """The robot as it is at this moment, to be looked at and changed."""
        with self._lock:
            self._catch_up()
            yield self.robot
            self._wake()

    def send(self, data: bytes) -> None:
        """Have the robot send ``data`` unasked. Faults do not apply."""
        with self._lock:
            if self._cable:
                self._cable.put([(0.0, data)])
                self._wake()

    def _wake(self) -> None:
        if self._cable:
            os.eventfd_write(self._cable.wake, 1)

    def _catch_up(self) -> None:
        """Let the robot live until now; what it says unasked goes out, or is lost without a cable."""
        now = time.monotonic()
        owed = math.inf if self._cable is None else self._due() + MOST_OWED  # unplugged, nobody looks at it
        with self._blamed():
            for frame in self.robot.live(min(now - self._moved_at, owed)):
                self._answer(frame)
        self._moved_at = now

    @contextmanager
    def _blamed(self) -> Iterator[None]:
        """A robot of one's own may raise anything. It is dead then: its cable is pulled, it does no more."""
        try:
            yield
        except BaseException as error:  # sys.exit() too: the robot would go on, and be mute
            if isinstance(error, KeyboardInterrupt) and _signals_come_here():
                raise
            self.failure = self.failure or blame(error, inspect.getfile(type(self.robot)))
            self._pull()

    def _answer(self, answer: bytes, refusal: bytes | None = None) -> None:
        """Send ``answer`` as the faults allow. Only what was asked for has a ``refusal``."""
        if self._cable is None:
            return
        pieces = self._line.sent(answer, refusal)
        if pieces is None:
            self._pull()
        else:
            self._cable.put(pieces)

    def _serve(self, cable: Cable) -> None:
        # Edge-triggered: a port that nobody has open reports that once, not for ever.
        with select.epoll() as events:
            events.register(cable.master, select.EPOLLIN | select.EPOLLOUT | select.EPOLLET)
            events.register(cable.wake, select.EPOLLIN | select.EPOLLET)
            while not cable.pulled:
                events.poll(self._patience(cable))
                with self._lock:
                    data = cable.leave() if self.faults.stuck else cable.read()
                    self._notice(cable.is_open() or bool(data))
                    if data or self._due() < math.inf:
                        self._catch_up()
                    with self._blamed():
                        for answer in self.robot.replies(data) if data else ():
                            self._answer(answer, self.robot.refusal)
                    if not cable.pulled:
                        cable.write()
        self._notice(False)
        cable.close()

    def _patience(self, cable: Cable) -> float | None:
        """Seconds until the line or the robot wants something; None if that needs an event first."""
        with self._lock:
            due = self._due() - (time.monotonic() - self._moved_at)
        if isinstance(self.robot, NoticesPort) and not self._is_open:
            due = min(due, LOOK_EVERY)
        waiting = cable.patience()
        if waiting is not None:
            due = min(due, waiting)
        return max(0.0, due) if due < math.inf else None

    def _notice(self, is_open: bool) -> None:
        """Tell the robot, if it cares, that its port has been opened or closed."""
        with self._lock:
            if is_open == self._is_open:
                return
            self._is_open = is_open
            if isinstance(self.robot, NoticesPort):
                self._catch_up()
                with self._blamed():
                    self.robot.opened() if is_open else self.robot.closed()

    def _due(self) -> float:
        """Seconds from where the robot is until it says something unasked."""
        with self._blamed():
            return self.robot.unasked_due()
        return math.inf


def _signals_come_here() -> bool:
    """Whether a Ctrl-C is raised in this thread; in all others it can only be somebody's own."""
    return threading.current_thread() is threading.main_thread()
