"""Since when the wheels of a robot have stood, by its counters. Pure."""

from __future__ import annotations

from swarm_onboard.driver.kinematics import Counters

SLOWEST = 0.02  # m/s: a wheel counts as standing once it is shown to be slower
_JITTER = 1  # counts by which a wheel that stands may differ: an edge of its encoder


class Stillness:
    """Takes the counters as they are read. ``since`` is the first of the readings that do not differ."""

    def __init__(self) -> None:
        self._first: Counters | None = None
        self._latest: Counters | None = None

    def take(self, counters: Counters | None) -> None:
        """Takes the latest reading; None: there is none on this line yet."""
        first = self._first
        if counters is None or first is None or not _close(first, counters):
            self._first = counters
        self._latest = counters

    def unchanged_since(self) -> float | None:
        """Returns the moment of the first of the readings that do not differ; None without one."""
        return self._first.stamp if self._first is not None else None

    def since(self, step: float | None, zero_at: float | None) -> float | None:
        """Returns since when the wheels have stood, if a reading after ``zero_at`` shows it.

        ``step``: the way of a wheel from one count to the next, in m.
        """
        if self._first is None or self._latest is None or step is None or zero_at is None:
            return None
        shown = self._latest.stamp >= zero_at and self.slower_than(step) <= SLOWEST
        return self._first.stamp if shown else None

    def slower_than(self, step: float) -> float:
        """Returns the speed, in m/s, that no wheel exceeded on average over the readings."""
        if self._first is None or self._latest is None or self._latest.stamp <= self._first.stamp:
            return float("inf")
        return (_JITTER + 1) * step / (self._latest.stamp - self._first.stamp)


def _close(one: Counters, other: Counters) -> bool:
    return abs(one.left - other.left) <= _JITTER and abs(one.right - other.right) <= _JITTER
