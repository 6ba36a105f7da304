"""How much the processors of the host work, and for which of its processes."""

from __future__ import annotations

import os
from contextlib import suppress

from .clip import clipped
from .named_tuple import NamedTuple
from .observations import LoadSeen

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Mapping

_SHORTEST = 50  # clock ticks of 10 ms
_MOST_NAMED = 3


class Work(NamedTuple):
    """How long the processors have worked since the boot, that time with the time they rested, and by number
    the name of each process that this host sees with its own time; all in clock ticks.
    """

    busy: int
    all: int
    processes: Mapping[int, tuple[str, int]]

    def since(self, before: Work) -> LoadSeen | None:
        """Returns the load since ``before``; None after less than 0.5 s."""
        passed = self.all - before.all
        if passed < _SHORTEST * (os.cpu_count() or 1):
            return None
        ticks = {
            pid: now - before.processes[pid][1]
            for pid, (_, now) in self.processes.items()
            if pid in before.processes
        }
        first = sorted(ticks, key=lambda pid: -ticks[pid])[:_MOST_NAMED]
        return LoadSeen(
            (self.busy - before.busy) / passed,
            sum(ticks.values()) / passed,
            [clipped(f"{self.processes[pid][0]} ({pid})") for pid in first],
        )


def work() -> Work:
    """Returns what the processors have done so far (proc_stat(5), proc_pid_stat(5))."""
    with open("/proc/stat", encoding="ascii") as file:
        ticks = [int(word) for word in file.readline().split()[1:9]]
    idle, waiting_for_disks = ticks[3:5]
    processes = {}
    for pid in filter(str.isdigit, os.listdir("/proc")):
        with suppress(OSError):  # it has ended
            with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
                name, _, fields = file.read().partition("(")[2].rpartition(") ")
            user, system = fields.split()[11:13]
            processes[int(pid)] = name, int(user) + int(system)
    return Work(sum(ticks) - idle - waiting_for_disks, sum(ticks), processes)
