"""Units of programs that run in trials alone: a condition of each is a file that exists as long as its trial.

The files are in /run, so that none of these units starts after a boot.
"""

from __future__ import annotations

import os

from . import files, systemd
from .paths import trial_file
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterable, Sequence


SUCCESS = "success"  # the result of a unit that ended well, in systemd


def allow(home: Home, units: Sequence[str]) -> None:
    """Lets units start from now on."""
    for unit in units:
        path = home.outside(trial_file(unit))
        os.makedirs(os.path.dirname(path), 0o755, exist_ok=True)
        with open(path, "wb"):
            pass


def forbid(home: Home, units: Iterable[str]) -> None:
    """Lets no unit start from now on."""
    for unit in units:
        files.remove(home.outside(trial_file(unit)))


def end(home: Home, units: Sequence[str]) -> None:
    """Stops units, which wait for the next trial then; one that had failed before keeps its state."""
    forbid(home, units)
    ran = [unit for unit, state in systemd.states(units).items() if state.up]
    systemd.stop(units)
    states = systemd.states(units)
    # Many nodes exit with an error when they are stopped: that is no failure.
    stopped = [one for one in ran if states[one].active == "failed" and states[one].result == "exit-code"]
    if stopped:
        systemd.call(["systemctl", "reset-failed", "--", *stopped], 20)
    # A start whose condition is not met makes it the unit's state that it waits for a trial.
    ended = [one for one in units if states[one].load == "loaded" and states[one].active == "inactive"]
    if waiting := [*ended, *stopped]:
        systemd.call(["systemctl", "start", "--", *waiting], 20)


def ended(units: Sequence[str]) -> dict[str, str]:
    """Returns those that have ended, with systemd's result, ``SUCCESS`` or such as ``exit-code``."""
    queued = {unit for unit, values in systemd.properties(units, ("Id", "Job")).items() if values.get("Job")}
    states = systemd.states([unit for unit in units if unit not in queued])
    return {unit: state.result for unit, state in states.items() if not state.up}
