"""A robot on a serial line: the pty it answers on, and the clock it moves by."""

from __future__ import annotations

import grp
import os
import select
import struct
import termios
import threading
import time
import tty
from collections import deque
from contextlib import suppress
from dataclasses import asdict, dataclass
from fcntl import ioctl
from pathlib import Path
from random import Random
from types import TracebackType

from swarmctl.lab.emulators.faults import Faults
from swarmctl.lab.emulators.robot import Robot, State

PTMX = Path("/dev/ptmx")
GROUP = "dialout"
MODE = 0o660
WAITING_LIMIT = 1 << 16  # bytes kept for a reader that does not read; replies past it are lost
RETRY = 0.05  # until a full pty is tried again, s

TIOCGPTN = 0x80045430  # the ioctls that termios does not name everywhere
TIOCSPTLCK = 0x40045431
TIOCGPTPEER = 0x5441


@dataclass(frozen=True)
class Snapshot(State):
    """The robot's true state at one moment, and whether its cable is in."""

    plugged: bool


class Cable:
    """One pty from plugging in to pulling out. Its master side is owned by the thread that serves it."""

    def __init__(self, ptmx: Path) -> None:
        self.master = os.open(ptmx, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            ioctl(self.master, TIOCSPTLCK, struct.pack("i", 0))
            (number,) = struct.unpack("I", ioctl(self.master, TIOCGPTN, bytes(4)))
            tty.setraw(self.master)
            self._prepare_slave()
        except BaseException:
            os.close(self.master)
            raise
        folder = ptmx.parent / "pts"  # the machine's own ptmx stands beside its devpts, all others within
        self.path = (folder if folder.is_dir() else ptmx.parent) / str(number)
        self.wake = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.pulled = False
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._size = 0
        self._sent = False  # since the port was last opened
        self._full = False  # the pty takes no more for now
        self._more = False  # the pty may have more to read

    def _open_slave(self) -> int:
        return ioctl(self.master, TIOCGPTPEER, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)

    def _prepare_slave(self) -> None:
        """Give it the mode of a serial port. Opened and closed once, it also tells when nobody has it."""
        slave = self._open_slave()
        try:
            with suppress(KeyError, PermissionError):
                os.fchown(slave, -1, grp.getgrnam(GROUP).gr_gid)
            os.fchmod(slave, MODE)
        finally:
            os.close(slave)

    def read(self) -> bytes:
        """What has arrived. When nobody has the port open any more, what was left unread is thrown away."""
        arrived = bytearray()
        self._more = True
        try:
            while len(arrived) < WAITING_LIMIT:
                arrived += os.read(self.master, 4096)
            return bytes(arrived)
        except BlockingIOError:
            pass
        except OSError:  # nobody has the port open
            if self._sent:
                self._forget_unread()
        self._more = False
        return bytes(arrived)

    def _forget_unread(self) -> None:
        with suppress(OSError):
            slave = self._open_slave()
            try:
                termios.tcflush(slave, termios.TCIFLUSH)
            finally:
                os.close(slave)
        self._sent = False

    def put(self, pieces: list[tuple[float, bytes]]) -> None:
        """Queue pieces, each the given seconds after the one before; nothing overtakes what is queued."""
        if self._size + sum(len(data) for _, data in pieces) > WAITING_LIMIT:
            return
        due = time.monotonic()
        for wait, data in pieces:
            due += wait
            self._waiting.append((due, data))
            self._size += len(data)

    def write(self) -> None:
        """Send what is due. To a port that nobody has open it is lost, as on a real line."""
        self._full = False
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            due, data = self._waiting.popleft()
            self._size -= len(data)
            if not self._is_open():
                continue
            self._sent = True
            try:
                written = os.write(self.master, data)
            except BlockingIOError:
                written = 0
            except OSError:
                continue
            if written < len(data):
                self._waiting.appendleft((due, data[written:]))
                self._size += len(data) - written
                self._full = True
                return

    def _is_open(self) -> bool:
        poll = select.poll()
        poll.register(self.master, 0)
        return not poll.poll(0)

    def patience(self) -> float | None:
        """Seconds until there is something to read or write; None if that needs an event first."""
        if self._more:
            return 0.0
        if not self._waiting:
            return None
        return RETRY if self._full else max(0.0, self._waiting[0][0] - time.monotonic())

    def close(self) -> None:
        os.close(self.master)
        os.close(self.wake)


class Port:
    """One robot and its cable. The robot moves by the monotonic clock, plugged or not, watched or not.

    Its motion is worked out when somebody commands or asks, and exactly, so a port with a quiet line costs
    nothing. ``faults`` may be set at any time.
    """

    def __init__(self, robot: Robot, ptmx: Path = PTMX) -> None:
        self.robot = robot
        self._ptmx = ptmx
        self._lock = threading.RLock()
        self._moved_at = time.monotonic()
        self._cable: Cable | None = None
        self._thread: threading.Thread | None = None
        self.faults = Faults()

    @property
    def faults(self) -> Faults:
        return self._faults

    @faults.setter
    def faults(self, faults: Faults) -> None:
        with self._lock:
            self._faults = faults
            self._random = Random(faults.seed)

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
            cable, thread = self._cable, self._thread
            self._cable = None
            if cable:
                cable.pulled = True
                os.eventfd_write(cable.wake, 1)
        if thread and thread is not threading.current_thread():
            thread.join()

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
            return Snapshot(**asdict(self.robot.state), plugged=self._cable is not None)

    def power_cycle(self) -> None:
        """Switch the robot off and on: it stands, forgets, and prints its banner."""
        with self._lock:
            self._catch_up()
            self.send(self.robot.power_cycle())

    def send(self, data: bytes) -> None:
        """Have the robot send ``data`` unasked. Faults do not apply."""
        with self._lock:
            if self._cable:
                self._cable.put([(0.0, data)])
                os.eventfd_write(self._cable.wake, 1)

    def _catch_up(self) -> None:
        now = time.monotonic()
        self.robot.advance(now - self._moved_at)
        self._moved_at = now

    def _serve(self, cable: Cable) -> None:
        # Edge-triggered: a port that nobody has open reports that once, not for ever.
        with select.epoll() as events:
            events.register(cable.master, select.EPOLLIN | select.EPOLLOUT | select.EPOLLET)
            events.register(cable.wake, select.EPOLLIN | select.EPOLLET)
            while not cable.pulled:
                events.poll(cable.patience())
                with self._lock:
                    if data := cable.read():
                        self._take(cable, data)
                    if not cable.pulled:
                        cable.write()
        cable.close()

    def _take(self, cable: Cable, data: bytes) -> None:
        self._catch_up()
        for answer in self.robot.replies(data):
            if self._faults.strikes(self._faults.vanish, self._random):
                self.unplug()
                return
            cable.put(self._faults.pieces(answer, self.robot.refusal, self._random))
