"""Starts units, after daemons have read their files, and waits until they run steadily."""

from __future__ import annotations

import os
import re
import time
from itertools import groupby

from . import systemd, unit_journal
from .errors import FailedError

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Sequence

    from .release_store import Home


STARTED = ("active", "reloading")
AGAIN, _LOOK_EVERY = 15.0, 0.5  # s
_LINES, _LONGEST = 12, 900  # of the log, lines and characters: roscore logs six lines while it ends
_RECENT = 600.0  # s
_ESCAPE = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\)|.)")  # ECMA-48


def start(units: Sequence[str]) -> None:
    """Starts units in this order and waits until systemd reports each as started. Raises ``FailedError``.

    A unit whose start failed has some seconds for the next attempt of systemd: a master starts again where a
    node was quicker than its clock.
    """
    if not units:
        return
    systemd.call(["systemctl", "reset-failed", "--", *units], 20)
    trouble = ""
    try:
        systemd.call(["systemctl", "start", "--", *units], 180)
    except FailedError as error:
        trouble = error.message
    seen = _after_attempts(units) if trouble else systemd.states(units)
    unwell = ("failed", "activating") if trouble else ("failed",)
    broken = [unit for unit, state in seen.items() if state.active in unwell]
    if broken:
        log = last_log(broken[0])
        raise FailedError("{} did not start{}".format(", ".join(broken), f": {log}" if log else ""))
    if trouble and not all(state.active in STARTED or state.skipped for state in seen.values()):
        raise FailedError(trouble)


def _after_attempts(units: Sequence[str]) -> dict[str, systemd.UnitState]:
    """The states of units once none is being started, or after ``AGAIN`` s."""
    end = time.monotonic() + AGAIN
    while True:
        seen = systemd.states(units)
        if not any(state.active == "activating" for state in seen.values()) or time.monotonic() > end:
            return seen
        time.sleep(_LOOK_EVERY)


def last_log(unit: str, most: int = _LINES, longest: int = _LONGEST) -> str:
    """Returns the last log messages of a unit, up to ``most``, on one line of up to ``longest`` characters.

    Terminal sequences, repetitions and systemd's own messages are left out.
    """
    try:
        messages = unit_journal.messages(unit, time.time() - _RECENT)
    except FailedError:
        return ""
    lines = [line for line, _ in groupby(_ESCAPE.sub("", one.text).strip() for one in messages) if line]
    text = ""
    for line in reversed(lines[-most:]):
        if text and len(line) + len(text) + 3 > longest:
            break
        text = f"{line} | {text}" if text else line[-longest:]
    return text


# chronyd reads its file only when it starts.
_SERVICES = {
    "chrony": ("chrony.service", "restart"),
    "NetworkManager": ("NetworkManager.service", "reload-or-restart"),
}


def reload_daemons(home: Home, names: Sequence[str]) -> None:
    """Makes daemons read their files again; udev applies its rules to the devices present.

    Raises ``FailedError`` with the last log lines of one that refuses its file.
    """
    if "systemd" in names:
        systemd.call(["systemctl", "daemon-reload"], 90)
    if "udev" in names and os.path.exists(home.outside("/run/udev/control")):
        systemd.call(["udevadm", "control", "--reload"], 20)
        kinds = ("--subsystem-match=tty", "--subsystem-match=usb-serial")
        systemd.call(["udevadm", "trigger", "--action=change", *kinds], 20)
        systemd.call(["udevadm", "settle", "--timeout=10"], 20)
    for name, (unit, verb) in _SERVICES.items():
        # One that is stopped reads its file when it starts; one that failed may have died of what is undone.
        if name in names and systemd.states([unit])[unit].active != "inactive":
            systemd.call(["systemctl", "reset-failed", "--", unit], 20)
            _again(unit, verb)


def _again(unit: str, verb: str) -> None:
    try:
        systemd.call(["systemctl", verb, "--", unit], 90)
    except FailedError as error:
        log = last_log(unit)
        raise FailedError(f"{unit} does not take its new file: {log}" if log else str(error)) from error


_STEADY_EVERY = 0.25  # s, at least


def not_steady(units: Sequence[str], seconds: float, within: float) -> str:
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
        time.sleep(min(max(_STEADY_EVERY, min(longest, seconds)), max(left, _STEADY_EVERY)))


def _wait(state: systemd.UnitState, age: float, seconds: float) -> float:
    """Returns the s for which a unit must still run."""
    if state.active in STARTED:
        return seconds - age
    ended = state.active == "inactive" and state.result in ("", "success")
    return 0.0 if ended or state.skipped else seconds


def _named(units: Sequence[str], within: float) -> str:
    log = last_log(units[0])
    which = " and ".join(units) if len(units) <= 2 else f"{units[0]} and {len(units) - 1} more"
    verb = "does" if len(units) == 1 else "do"
    return f"{which} {verb} not keep running within {within:g} s" + (f": {log}" if log else "")
