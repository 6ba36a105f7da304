"""Waits until units have run for some time without a restart."""

from __future__ import annotations

import time

from . import systemd, unit_start

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Sequence

_LOOK_EVERY = 0.25  # s, at least


def trouble(units: Sequence[str], seconds: float, within: float) -> str:
    """Returns empty text once every unit has run for ``seconds``; after ``within`` s those that have not.

    A unit counts that was skipped, or whose program ended without an error.
    """
    end = time.monotonic() + within
    while True:
        states, ages = systemd.states(units), systemd.active_for(units)
        waits = {unit: _wait(state, ages[unit], seconds) for unit, state in states.items()}
        longest = max(waits.values(), default=0.0)
        failed = [unit for unit, state in states.items() if state.active == "failed"]
        if longest <= 0:
            return ""
        left = end - time.monotonic()
        if failed or left <= 0:
            return _named(failed or [unit for unit, wait in waits.items() if wait > 0], within)
        time.sleep(min(max(_LOOK_EVERY, min(longest, seconds)), max(left, _LOOK_EVERY)))


def _wait(state: systemd.UnitState, age: float, seconds: float) -> float:
    """Returns the s for which a unit must still run."""
    if state.active in unit_start.STARTED:
        return seconds - age
    ended = state.active == "inactive" and state.result in ("", "success")
    return 0.0 if ended or state.skipped else seconds


def _named(units: Sequence[str], within: float) -> str:
    log = unit_start.last_log(units[0])
    which = " and ".join(units) if len(units) <= 2 else f"{units[0]} and {len(units) - 1} more"
    verb = "does" if len(units) == 1 else "do"
    return f"{which} {verb} not keep running within {within:g} s" + (f": {log}" if log else "")
