"""A driver's port under test: records the time of everything written, and can wait for input."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from swarm_driver.link import BytePort


@dataclass
class TimedPort:
    port: BytePort
    clock: Callable[[], float] = time.monotonic
    written: list[tuple[float, bytes]] = field(default_factory=list)
    _held: bytes = b""

    def write(self, data: bytes) -> None:
        self.port.write(data)
        self.written.append((self.clock(), data))

    def read(self, timeout: float) -> bytes:
        if self._held:
            held, self._held = self._held, b""
            return held
        return self.port.read(timeout)

    def wait(self, timeout: float) -> None:
        """Waits until there is something to ``read``, or for ``timeout`` seconds."""
        if not self._held:
            self._held = self.port.read(timeout)

    def drain(self) -> None:
        self._held = b""
        self.port.drain()

    def fileno(self) -> int:
        return self.port.fileno()

    def close(self) -> None:
        self.port.close()
