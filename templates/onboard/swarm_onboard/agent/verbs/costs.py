"""``costs``: the CPU time and the memory that each unit of the swarm takes, from its processes."""

from __future__ import annotations

import os
import time
from contextlib import suppress

from swarm_onboard.agent import control_groups
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")


class Request(NamedTuple):
    """What the units of the swarm on this host take."""

    swarm: str


class UnitCosts(NamedTuple):
    """``cpu``: CPU time, of ended children too, s; ``memory``: resident, bytes; ``processes``: number."""

    cpu: float = 0.0
    memory: int = 0
    processes: int = 0


class Answer(NamedTuple):
    """The units that run, by name; ``clock``: s of the host's monotonic clock."""

    clock: float
    units: dict[str, UnitCosts]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns what the units that run have taken so far."""
    units = control_groups.of_swarm(home_of(request.swarm).swarm)
    return Answer(
        time.monotonic(), {unit: _of(folder) for unit, folder in units.items() if unit.endswith(".service")}
    )


def _of(folder: str) -> UnitCosts:
    """The sums over the processes of a control group (proc_pid_stat(5))."""
    cpu, memory, processes = 0.0, 0, 0
    for pid in control_groups.processes(folder):
        with suppress(OSError, IndexError):  # it has ended
            with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
                fields = file.read().rpartition(") ")[2].split()
            cpu += sum(map(int, fields[11:15])) / _TICKS
            memory += int(fields[21]) * _PAGE
            processes += 1
    return UnitCosts(cpu, memory, processes)
