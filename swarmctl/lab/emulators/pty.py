"""A pty as a serial cable: readers may come and go or never read, and get a hangup when it is unplugged."""

from __future__ import annotations

import grp
import os
import select
import struct
import termios
import time
import tty
from collections import deque
from contextlib import suppress
from fcntl import ioctl
from pathlib import Path

GROUP = "dialout"
MODE = 0o660
WAITING_LIMIT = 1 << 16  # bytes kept for a reader that does not read; replies past it are lost
RETRY = 0.05  # until a full pty is tried again, s

TIOCGPTN = 0x80045430  # the ioctls that termios does not name everywhere
TIOCSPTLCK = 0x40045431
TIOCGPTPEER = 0x5441


class Cable:
    """One pty from plug to unplug. The serving thread owns its master side."""

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
        """Sets the mode of a serial port.

        After one open and close, the master also reports a closed slave.
        """
        slave = self._open_slave()
        try:
            with suppress(KeyError, PermissionError):
                os.fchown(slave, -1, grp.getgrnam(GROUP).gr_gid)
            os.fchmod(slave, MODE)
        finally:
            os.close(slave)

    def read(self) -> bytes:
        """Returns the received bytes. When the port is closed, unread output is discarded."""
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

    def ignore(self) -> bytes:
        """Leaves received bytes in the pty, so that writers block."""
        self._more = False
        return b""

    def _forget_unread(self) -> None:
        with suppress(OSError):
            slave = self._open_slave()
            try:
                termios.tcflush(slave, termios.TCIFLUSH)
            finally:
                os.close(slave)
        self._sent = False

    def put(self, pieces: list[tuple[float, bytes]]) -> None:
        """Queues pieces, each the given seconds after the one before; the order is kept."""
        if self._size + sum(len(data) for _, data in pieces) > WAITING_LIMIT:
            return
        due = time.monotonic()
        for wait, data in pieces:
            due += wait
            self._waiting.append((due, data))
            self._size += len(data)

    def write(self) -> None:
        """Sends what is due. It is lost if the port is closed, as on a real line."""
        self._full = False
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            due, data = self._waiting.popleft()
            self._size -= len(data)
            if not self.is_open():
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

    def is_open(self) -> bool:
        """Whether a program has the port open."""
        poll = select.poll()
        poll.register(self.master, 0)
        return not poll.poll(0)

    def wait_time(self) -> float | None:
        """Returns the seconds until it can read or write; None if that needs an event first."""
        if self._more:
            return 0.0
        if not self._waiting:
            return None
        return RETRY if self._full else max(0.0, self._waiting[0][0] - time.monotonic())

    def close(self) -> None:
        """Closes both ends."""
        os.close(self.master)
        os.close(self.wake)
