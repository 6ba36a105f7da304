"""``costs``: the CPU time and the memory that each unit of the swarm takes, from its processes."""

from __future__ import annotations

import os
import time
from contextlib import suppress

from swarm_onboard.agent import control_groups
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.cost_messages import CostsAnswer, CostsRequest, UnitCosts

_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")


def handle(request: CostsRequest, payload: bytes, report: Report) -> CostsAnswer:
    """Returns what the units that run have taken so far."""
    units = control_groups.of_swarm(home_of(request["swarm"]).swarm)
    return {
        "clock": time.monotonic(),
        "units": {unit: _of(folder) for unit, folder in units.items() if unit.endswith(".service")},
    }


def _of(folder: str) -> UnitCosts:
    """The sums over the processes of a control group (proc_pid_stat(5))."""
    found: UnitCosts = {"cpu": 0.0, "memory": 0, "processes": 0}
    for pid in control_groups.processes(folder):
        with suppress(OSError, IndexError):  # it has ended
            with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
                fields = file.read().rpartition(") ")[2].split()
            found["cpu"] += sum(map(int, fields[11:15])) / _TICKS
            found["memory"] += int(fields[21]) * _PAGE
            found["processes"] += 1
    return found
