"""Readiness, status and watchdog for systemd (sd_notify(3)). Without systemd every call does nothing."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import time
from typing import Callable, Iterator, Mapping

REJOINS = 91
"""Exit code of a node that ends because the ROS master was restarted: no other program is known to use it."""
WAITS = "waits for "
"""How the status text of a program begins that cannot do its task yet; what it waits for follows."""


class Notifier:
    """Writes to the socket that systemd names in the environment."""

    def __init__(
        self, environment: Mapping[str, str] = os.environ, clock: Callable[[], float] = time.monotonic
    ) -> None:
        name = environment.get("NOTIFY_SOCKET", "")
        self._address = "\0" + name[1:] if name.startswith("@") else name
        # Opened once: a node whose file descriptors are used up by connections must still send beats.
        self._channel = _channel() if self._address else None
        self._clock = clock
        self._last_beat = -float("inf")
        self._failed = False
        microseconds = environment.get("WATCHDOG_USEC", "")
        ours = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        #: Seconds between two beats, a third of what systemd waits for; none when it does not watch.
        self.interval = int(microseconds) / 3e6 if ours and microseconds.isdigit() else None

    def ready(self) -> None:
        """Reports the unit as started."""
        self._send("READY=1")

    def beat(self) -> None:
        """Notifies systemd that the loop is alive, as often as its watchdog requires.

        May be called more often.
        """
        now = self._clock()
        if self.interval is not None and now - self._last_beat >= self.interval:
            self._last_beat = now
            self._send("WATCHDOG=1")

    @contextlib.contextmanager
    def seldom_beating(self, seconds: float) -> Iterator[None]:
        """Makes systemd's watchdog wait for ``seconds`` meanwhile."""
        if self.interval is None:
            yield
            return
        self._send(f"WATCHDOG_USEC={round(seconds * 1e6)}")
        try:
            yield
        finally:
            self._send(f"WATCHDOG_USEC={round(self.interval * 3e6)}")

    def status(self, text: str, *, error: bool = False) -> None:
        """Sets the status text of the unit. ``error``: it cannot do its task, which `StatusErrno` shows."""
        self._failed |= error
        number = f"\nERRNO={errno.EIO if error else 0}" if self._failed else ""
        self._send(f"STATUS={' '.join(text.split())}{number}")

    def forget(self, name: str) -> None:
        """Closes the files of this name that systemd keeps for the unit (FileDescriptorStoreMax=)."""
        self._send(f"FDSTOREREMOVE=1\nFDNAME={name.replace(':', '.')}")

    def stopping(self) -> None:
        """Reports the unit as stopping."""
        self._send("STOPPING=1")

    def _send(self, message: str) -> None:
        if self._channel is not None:
            with contextlib.suppress(OSError):  # a deaf systemd must not stop a node
                self._channel.sendto(message.encode(), self._address)


def _channel() -> socket.socket:
    channel = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
    channel.setblocking(False)
    return channel
