"""When which node commanded the robot, as entries for the record: begin and end of each span. Pure."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any, Dict, NamedTuple

GAP = 10.0  # s; a shorter interruption is part of the span
MOST = 8  # spans at a time; one more ends the one whose last command is the oldest

Entry = Dict[str, Any]


class By(NamedTuple):
    """Whose commands a span has."""

    commander: str
    node: str
    host: str


@dataclass
class _Span:
    """``first`` and ``last`` command on the monotonic clock; ``ended``: the last one on the host's clock."""

    first: float
    last: float
    ended: float


class CommandSpans:
    """The spans that go on now. ``now`` is monotonic, ``time`` is s since 1970 by the host's clock."""

    def __init__(self) -> None:
        self._open: OrderedDict[By, _Span] = OrderedDict()  # the latest command at the end

    def admitted(self, by: By, now: float, time: float) -> list[Entry]:
        """Takes an obeyed command. Returns the entries that are due."""
        due = self.silent(now)
        span = self._open.pop(by, None)
        if span is None:
            if len(self._open) == MOST:
                due.append(_end(*self._open.popitem(last=False)))
            due.append({"time": round(time, 3), "event": "began", **by._asdict()})
            span = _Span(now, now, time)
        self._open[by] = span
        span.last, span.ended = now, time
        return due

    def silent(self, now: float) -> list[Entry]:
        """Returns the ends of the spans that have had no command for ``GAP``."""
        due = []
        while self._open and now >= next(iter(self._open.values())).last + GAP:
            due.append(_end(*self._open.popitem(last=False)))
        return due

    def next_silence(self) -> float:
        """Returns when ``silent`` has the next end if no command comes; infinity without a span."""
        return next(iter(self._open.values())).last + GAP if self._open else math.inf

    def close(self) -> list[Entry]:
        """Ends all spans. Returns their ends."""
        return self.silent(math.inf)


def _end(by: By, span: _Span) -> Entry:
    seconds = round(span.last - span.first, 1)
    return {"time": round(span.ended, 3), "event": "ended", **by._asdict(), "seconds": seconds}
