"""Which commands a network held up. Knows no ROS.

Clocks of hosts differ, so no age is absolute: what counts is how much longer a message took than the
quickest one of its sender lately.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

_MOST = 64  # senders that are remembered
_DRIFT = 0.02  # s by which the quickest may have become slower with each message: clocks drift


@dataclass
class _Sender:
    """``quickest``: arrival minus departure; ``late_since``: arrival of the first of the late ones."""

    quickest: float
    late_since: float | None = None


class Late:
    """``limit``: how much longer than the quickest one a command may take, s."""

    def __init__(self, limit: float) -> None:
        self.lag = 0.0  # of the last command: how much longer than the quickest one it took, s
        self._limit = limit
        self._senders: OrderedDict[bytes, _Sender] = OrderedDict()

    def is_late(self, sender: bytes, sent: float, arrived: float) -> bool:
        """Returns True for a command that took too long; both times in s, each by the clock of its host.

        If all commands of a sender are late for longer than the limit, a clock was set: they count again.
        """
        took = arrived - sent
        known = self._senders.setdefault(sender, _Sender(took))
        self._senders.move_to_end(sender)
        if len(self._senders) > _MOST:
            self._senders.popitem(last=False)
        known.quickest = min(known.quickest + _DRIFT * self._limit, took)
        self.lag = took - known.quickest
        if self.lag <= self._limit:
            known.late_since = None
            return False
        if known.late_since is None:
            known.late_since = arrived
        if arrived - known.late_since <= 2 * self._limit:
            return True
        known.quickest, known.late_since = took, None
        return False
