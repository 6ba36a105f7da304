"""A robot under test on its port: what the benches of polled robots and of rosserial boards share."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from swarm_onboard.driver.config import Config
from swarm_onboard.driver.link import BytePort
from swarm_onboard.driver.port import PortError

from swarmctl.conformance.motion_base import Pace
from swarmctl.conformance.timed_port import TimedPort

T = TypeVar("T")


class SerialBench:
    """``clock`` and ``sleep`` may be those of an emulated board."""

    def __init__(
        self,
        config: Config,
        open_port: Callable[[], BytePort],
        pace: Pace,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.config, self.open_port, self.pace = config, open_port, pace
        self.clock, self.sleep = clock, sleep
        self._port: TimedPort | None = None

    @property
    def port(self) -> TimedPort:
        """The open port. Raises ``PortError`` if it is closed."""
        return self.opened(self._port)

    def opened(self, part: T | None) -> T:
        """Returns ``part``, which exists only while the port is open. Raises ``PortError``."""
        if part is None:
            raise PortError(f"{self.config.port} is not open")
        return part
