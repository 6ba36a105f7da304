"""Starts units; one that does not start is reported with what it logged last."""

from __future__ import annotations

import re
import time
from itertools import groupby

from . import systemd, unit_journal
from .errors import FailedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Sequence

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
