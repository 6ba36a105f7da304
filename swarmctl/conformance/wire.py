"""A driver's port on the bench: everything that goes out has its time, what comes in can be waited for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from swarm_driver.link import BytePort


@dataclass
class Wire:
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
        """Until there is something to ``read``."""
        if not self._held:
            self._held = self.port.read(timeout)

    def drain(self) -> None:
        self._held = b""
        self.port.drain()

    def fileno(self) -> int:
        return self.port.fileno()

    def close(self) -> None:
        self.port.close()
