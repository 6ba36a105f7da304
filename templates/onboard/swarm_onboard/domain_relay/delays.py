"""How late the commands of a topic came within the last minute, and how many were too late. Knows no ROS."""

from __future__ import annotations

from collections import deque

_WINDOW = 60.0  # s
_MOST = 2000  # messages that are remembered
_WORTH_NAMING = 0.1  # s


class Delays:
    """What is remembered of the latest commands of a topic."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float, bool]] = deque(maxlen=_MOST)

    def add(self, now: float, lag: float, *, dropped: bool) -> None:
        """Adds a command that came ``lag`` s later than the quickest one, at ``now`` s."""
        self._seen.append((now, lag, dropped))

    def dropped(self, now: float) -> int:
        """Returns how many were dropped within the window."""
        return sum(dropped for at, _, dropped in list(self._seen) if at > now - _WINDOW)

    def text(self, now: float) -> str:
        """Returns both for people; empty if nothing was late."""
        worst = max((lag for at, lag, _ in list(self._seen) if at > now - _WINDOW), default=0.0)
        parts = [f"up to {worst:.1f} s late"] if worst >= _WORTH_NAMING else []
        if count := self.dropped(now):
            parts.append(f"{count} dropped")
        return ", ".join(parts)
