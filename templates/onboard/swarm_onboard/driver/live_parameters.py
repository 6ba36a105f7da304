"""Has a running driver take its parameter file again, as long as nothing but ``live_values`` changes.

The agent requests it with a datagram on the socket of the stop latch, ``reload`` and a word of its own, and
finds in the answers which file the driver works with, and why it refused one.
"""

from __future__ import annotations

import contextlib
from collections import deque
from dataclasses import dataclass
from threading import Event, Thread
from typing import Any, Callable, Mapping

from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.driver.config import Config, load
from swarm_onboard.driver.live_values import differing

_RELOAD = "reload "


@dataclass(frozen=True)
class _Reading:
    """What a request found in the file: parameters to take, or why they are not taken."""

    request: str
    config: Config | None
    refusal: str
    taken: Event


class LiveParameters:
    """``requested``, ``look`` and ``state`` belong to the driver's thread.

    The file is read in another one: that takes longer than an exchange with the robot.
    """

    def __init__(
        self,
        config: Config,
        take: Callable[[Config], None],
        show: Callable[[], None],
        ring: Callable[[], None],
    ) -> None:
        """``take`` is called in the driver's thread; ``show`` in another one afterwards."""
        self.config = config
        self._take = take
        self._show = show
        self._ring = ring
        self._request = self._done = self._refusal = ""
        self._readings: deque[_Reading] = deque()

    def requested(self, request: str) -> None:
        """Begins to read the file, once for each request."""
        if request.startswith(_RELOAD) and request != self._request:
            self._request = request
            with contextlib.suppress(RuntimeError):  # too many threads: no answer, and the driver drives on
                Thread(target=self._read, args=(request,), daemon=True).start()

    def look(self) -> None:
        """Takes what the latest request found."""
        while self._readings:
            reading = self._readings.popleft()
            if reading.request == self._request:
                if reading.config is not None:
                    self._take(reading.config)
                    self.config = reading.config
                self._done, self._refusal = reading.request, reading.refusal
            reading.taken.set()

    def state(self) -> Mapping[str, Any]:
        """Returns the SHA-256 of the file in use, the last request that is done, and why it was refused."""
        return {"params": self.config.digest, "reloaded": self._done, "refusal": self._refusal}

    def _read(self, request: str) -> None:
        reading = self._found(request)
        self._readings.append(reading)
        self._ring()
        if reading.config is not None:
            reading.taken.wait()
            self._show()

    def _found(self, request: str) -> _Reading:
        try:
            config = load(self.config.file)
        except ConfigError as error:
            return _Reading(request, None, str(error), Event())
        names = ", ".join(differing(self.config.fixed, config.fixed))
        if names:
            return _Reading(request, None, f"it takes {names} only when it starts", Event())
        return _Reading(request, config, "", Event())
