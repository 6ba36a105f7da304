"""A driver's port under test: records the time of everything written, and can wait for input."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from swarm_onboard.driver.link import BytePort

MOST_KEPT = 512  # received bytes


@dataclass
class TimedPort:
    """A port that records what is written, with its time."""

    port: BytePort
    clock: Callable[[], float] = time.monotonic
    written: list[tuple[float, bytes]] = field(default_factory=list)
    received: bytes = b""  # since something was written last
    _held: bytes = b""

    def write(self, data: bytes) -> None:
        """Writes and records ``data``."""
        self.received = b""
        self.port.write(data)
        self.written.append((self.clock(), data))

    def read(self, timeout: float) -> bytes:
        """Returns what has arrived within ``timeout`` seconds; held bytes first."""
        if self._held:
            held, self._held = self._held, b""
            return held
        return self._received(timeout)

    def wait(self, timeout: float) -> None:
        """Waits until there is something to ``read``, or for ``timeout`` seconds."""
        if not self._held:
            self._held = self._received(timeout)

    def _received(self, timeout: float) -> bytes:
        data = self.port.read(timeout)
        self.received = (self.received + data)[-MOST_KEPT:]
        return data

    def drain(self) -> None:
        """Discards what has arrived."""
        self._held = b""
        self.port.drain()

    def fileno(self) -> int:
        """Returns the file descriptor of the port."""
        return self.port.fileno()

    def close(self) -> None:
        """Closes the port."""
        self.port.close()
