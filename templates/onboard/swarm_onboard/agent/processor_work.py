"""How much the processors of the host work."""

from __future__ import annotations

import os

from .named_tuple import NamedTuple

_SHORTEST = 50  # clock ticks of 10 ms


class Work(NamedTuple):
    """How long the processors have worked since the boot, and that time with the time they rested."""

    busy: int
    all: int

    def share_since(self, before: Work) -> float | None:
        """Returns the share of the time since ``before`` in which they worked; None after less than 0.5 s."""
        passed = self.all - before.all
        return (self.busy - before.busy) / passed if passed >= _SHORTEST * (os.cpu_count() or 1) else None


def work() -> Work:
    """Returns what the processors have done so far, in clock ticks (proc_stat(5))."""
    with open("/proc/stat", encoding="ascii") as file:
        ticks = [int(word) for word in file.readline().split()[1:9]]
    idle, waiting_for_disks = ticks[3:5]
    return Work(sum(ticks) - idle - waiting_for_disks, sum(ticks))
