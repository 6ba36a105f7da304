"""When a stand-in publishes: which topics are due, and how long it waits. Knows no ROS and no clock."""

from __future__ import annotations

import math
from typing import Sequence

STEP = 0.02  # s, the longest step of the body
_SHORTEST = 0.001  # s: a faster rate than 1 kHz is not kept


class Schedule:
    """Topics with their rates in Hz from the moment ``began``, s; 0 for one message at the start.

    A late topic catches up with one message at most.
    """

    def __init__(self, rates: Sequence[float], began: float) -> None:
        self._periods = [1 / rate if rate > 0 else math.inf for rate in rates]
        self._due = [began] * len(self._periods)

    def ready(self, now: float) -> list[int]:
        """Returns the indexes of the topics that are due at ``now``, and plans their next message."""
        found = [index for index, due in enumerate(self._due) if due <= now]
        for index in found:
            self._due[index] = max(self._due[index] + self._periods[index], now)
        return found

    def pause(self, now: float) -> float:
        """Returns the time until the next topic is due, s; at most ``STEP``, the step of the body."""
        return min(STEP, max(_SHORTEST, min(self._due, default=math.inf) - now))
