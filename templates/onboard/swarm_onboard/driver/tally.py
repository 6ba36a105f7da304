"""What happened since the driver started, and how often in the last seconds."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass


@dataclass
class Tally:
    """Counts what has happened since the driver started."""

    connections: int = 0
    failed_exchanges: int = 0
    noise_lines: int = 0
    dead_man_trips: int = 0
    last_error: str = "none"
    reported: str = ""  # by the robot: what is wrong with it

    def failed(self, error: Exception) -> None:
        """Counts a failed exchange."""
        self.failed_exchanges += 1
        self.last_error = str(error)


class Meter:
    """Measures how often something happened in the last ``window`` seconds."""

    def __init__(self, window: float = 5.0) -> None:
        self._window = window
        self._stamps: deque[float] = deque()

    def tick(self, now: float) -> None:
        """Records that it happened at ``now``."""
        self._stamps.append(now)

    def rate(self, now: float) -> float:
        """Returns Hz, from the intervals in the window; it falls off when nothing happens any more."""
        while self._stamps and self._stamps[0] < now - self._window:
            self._stamps.popleft()
        intervals = len(self._stamps) - 1
        if intervals < 1:
            return 0.0
        seen = self._stamps[-1] - self._stamps[0]
        overdue = max(0.0, now - self._stamps[-1] - seen / intervals)
        return intervals / (seen + overdue) if seen > 0 else 0.0
