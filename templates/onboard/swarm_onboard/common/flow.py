"""How often messages come, from the times at which they arrive."""

from __future__ import annotations


class Flow:
    """What came over a topic within ``seconds``: how many messages, and at what rate."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.count = 0
        self.type = ""
        self._first = self._last = 0.0

    def tick(self, now: float) -> None:
        """Counts a message at ``now``."""
        self._first = self._first if self.count else now
        self._last = now
        self.count += 1

    def rate(self, now: float) -> float | None:
        """Hz, from the intervals between messages, less once the next is overdue; None before the second."""
        intervals, seen = self.count - 1, self._last - self._first
        if intervals < 1:
            return None
        overdue = max(0.0, now - self._last - seen / intervals)
        return intervals / max(seen + overdue, 1e-3)

    def age(self, now: float) -> float | None:
        """Seconds since the last message; None before the first."""
        return now - self._last if self.count else None
