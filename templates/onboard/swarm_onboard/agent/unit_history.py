"""What a single look at systemd does not show of units: recent restarts, and processes that are stopped."""

from __future__ import annotations

import os
import time

from . import processes, systemd, unit_journal, unit_start
from .processes import Process
from .release_store import Home
from .texts import clipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Mapping, Sequence

    from .systemd import UnitState

_MOST_NAMES = 20  # processes of one unit
_MOST_LOGS = 20  # units whose logs are read
_LINES, _LONGEST = 3, 160  # of a log: a robot confirms its stop, and restart-delay waits, after the error
_BEGAN, _ACTIVE = "InactiveExitTimestampMonotonic", "ActiveEnterTimestampMonotonic"


def running(units: Sequence[str]) -> dict[str, list[Process]]:
    """The processes of each unit."""
    shown = systemd.properties(units, ("Id", "ControlGroup"))
    return processes.of_units({unit: values.get("ControlGroup", "") for unit, values in shown.items()})


def with_stopped(units: Mapping[str, UnitState]) -> dict[str, UnitState]:
    """Returns the states of units with the processes that a signal or a debugger has stopped."""
    found = running(list(units))
    return {
        unit: state._replace(
            stopped=[clipped(f"{one.pid} ({one.name})") for one in found.get(unit, ()) if one.stopped][
                :_MOST_NAMES
            ]
        )
        for unit, state in units.items()
    }


def with_restarts(
    home: Home, units: Mapping[str, UnitState], window: float
) -> tuple[dict[str, UnitState], dict[str, float]]:
    """Returns the states of units with their latest restarts, and since when these count, s since 1970.

    ``window``: s before now. A start by hand or by a deploy, and ``systemctl reset-failed``, begin a new
    count.
    """
    begin = _begin(home, window)
    troubled = [unit for unit, state in units.items() if state.restarts or state.active == "failed"]
    found = unit_journal.restarts(troubled, begin) if troubled else {}
    nothing = unit_journal.Restarts([], "", 0)
    starts = _times([unit for unit in units if not units[unit].restarts], _BEGAN)
    again = [unit for unit in troubled if units[unit].active == "active"]
    active = _times(again, _ACTIVE) if again else {}
    away = [unit for unit, state in units.items() if state.active in ("activating", "failed")]
    logs = {unit: unit_start.last_log(unit, _LINES, _LONGEST) for unit in away[:_MOST_LOGS]}
    now = time.time()
    known = {
        unit: state._replace(
            recent=min(state.restarts, len(found.get(unit, nothing).times)),
            rejoined=min(state.restarts, found.get(unit, nothing).rejoined),
            exit=found.get(unit, nothing).exit,
            running=round(max(0.0, now - active.get(unit, now)), 1),
            starting=round(max(0.0, now - starts[unit]), 1)
            if state.active == "activating" and unit in starts
            else 0.0,
            log=logs.get(unit, ""),
        )
        for unit, state in units.items()
    }
    return known, {unit: max(begin, starts.get(unit, begin)) for unit in units}


def _begin(home: Home, window: float) -> float:
    """``window`` s ago, in s since 1970, or when the current release began."""
    begin = time.time() - window
    try:
        return max(begin, os.lstat(home.current_link).st_mtime)
    except FileNotFoundError:
        return begin


def _times(units: Sequence[str], stamp: str) -> dict[str, float]:
    """A time stamp of each unit that systemd counts from the boot, in s since 1970."""
    booted = time.time() - time.monotonic()
    shown = systemd.properties(units, ("Id", stamp))
    return {unit: booted + int(values.get(stamp) or 0) / 1e6 for unit, values in shown.items()}
