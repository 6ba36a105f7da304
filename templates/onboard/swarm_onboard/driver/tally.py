"""What happened since the driver started, and how often in the last seconds and minutes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

_BUCKET = 1.0  # s that are counted together
# A line in order loses nothing. Two lost replies in a row to a speed, which is sent 5 times a second, end the
# connection: with a share p lost, every 1 / (5 p^2) s. At 2 % that is every 8 minutes, at 5 % every 80 s.
_TOO_MANY = 0.02
_FEW = 5  # failures that one interruption may cause, such as a robot that resets itself
_OFTEN_LOST = 3  # times; also the number of restarts that status allows a unit in that time


class Lately:
    """Counts what went right and wrong in the last ``window`` seconds, to the second."""

    def __init__(self, window: float) -> None:
        self._window = window
        self._buckets: deque[tuple[float, int, int]] = deque()  # its begin, right, wrong

    def add(self, now: float, right: int = 0, wrong: int = 0) -> None:
        """Counts what happened at ``now``."""
        if self._buckets and now < self._buckets[-1][0] + _BUCKET:
            begin, before, wrong_before = self._buckets.pop()
            self._buckets.append((begin, before + right, wrong_before + wrong))
        else:
            self._buckets.append((now, right, wrong))
        self._forget(now)

    def counts(self, now: float) -> tuple[int, int]:
        """Returns how often it went wrong, and how often it happened at all."""
        self._forget(now)
        wrong = sum(one[2] for one in self._buckets)
        return wrong, wrong + sum(one[1] for one in self._buckets)

    def _forget(self, now: float) -> None:
        while self._buckets and self._buckets[0][0] < now - self._window:
            self._buckets.popleft()


@dataclass
class Tally:
    """Counts what has happened since the driver started."""

    connections: int = 0
    failed_exchanges: int = 0
    noise_lines: int = 0
    dead_man_trips: int = 0
    last_error: str = "none"
    reported: str = ""  # by the robot: what is wrong with it
    last_loss: str = ""
    transfers: Lately = field(default_factory=lambda: Lately(60.0))  # requests, or frames of a board
    losses: Lately = field(default_factory=lambda: Lately(600.0))  # of a connection to a known robot

    def failed(self, error: Exception) -> None:
        """Counts a failed exchange."""
        self.failed_exchanges += 1
        self.last_error = str(error)

    def lost(self, now: float, reason: str) -> None:
        """Counts a connection to a known robot that was lost."""
        self.losses.add(now, wrong=1)
        self.last_loss = reason

    def failing(self, now: float, what: str) -> str:
        """Returns how many transfers failed in the last minute, as ``what`` says it; nothing if few did."""
        wrong, total = self.transfers.counts(now)
        return f"{wrong} of {total} {what}" if wrong >= _FEW and wrong > _TOO_MANY * total else ""

    def losing(self, now: float) -> str:
        """Returns how often the connection was lost in the last ten minutes; nothing if that is rare."""
        times, _ = self.losses.counts(now)
        if times < _OFTEN_LOST:
            return ""
        return f"the connection was lost {times} times in the last 10 minutes (last: {self.last_loss})"


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
