"""Nodes whose name another node has taken, as the logs of their units have it.

The master asks a registered node to end when another one registers under its name
(rosmaster/registrations.py), with a reason that rospy, roscpp and swarmctl's drivers log; the latter go on.
"""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING, Iterable

from swarm_onboard.agent import unit_journal
from swarm_onboard.agent.clip import clipped
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.observations import ConflictSeen

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Answer

_OF_PYTHON = "shutdown request: "  # begins that line of rospy and of the drivers
_TAKEN = "Reason: new node registered with same name"
_REASON = re.compile(rf"\[(/[^\]\s]+)\] {_TAKEN}")
_MOST_UNITS = 20  # whose logs are read
_LONGEST = 10.0  # s for all logs


def added(answer: Answer) -> Answer:
    """Returns the answer with the conflicts of units that logged one, were restarted, do not run, or have
    lost a node.

    The states of the units are the last ones of the probe: one that was ended during it counts, too.
    """
    began = time.monotonic()
    conflicts = {}
    trouble = ""
    try:
        for unit, since in _suspicious(answer)[:_MOST_UNITS]:
            if time.monotonic() - began > _LONGEST:
                trouble = "the logs of the units took too long to read"
                break
            found = conflicts_in(unit_journal.messages(unit, since), time.time())
            if found:
                conflicts[unit] = found
    except RefusedError as error:
        trouble = clipped(error.message)
    troubles = {**answer.troubles, "conflicts": trouble} if trouble else answer.troubles
    return answer._replace(conflicts=conflicts, troubles=troubles)


def _suspicious(answer: Answer) -> list[tuple[str, float]]:
    """Units to look at, each with the time from which on its log counts. Raises RefusedError."""
    since = min(answer.since.values(), default=0.0)
    requested = unit_journal.units_with([f"{_OF_PYTHON}[{node}] {_TAKEN}" for node in answer.nodes], since)
    lost = {
        unit for unit, one in answer.launched.items() if one.ended or max(one.starts.values(), default=1) > 1
    }
    return [
        (unit, answer.since[unit])
        for unit, state in answer.units.items()
        if unit in answer.since
        and (unit in requested or unit in lost or state.restarted or state.active != "active" or state.recent)
    ]


def conflicts_in(lines: Iterable[unit_journal.Message], now: float) -> dict[str, ConflictSeen]:
    """How often each node was ended by another of its name, and how long before ``now``, s."""
    found: dict[str, ConflictSeen] = {}
    for line in lines:
        match = _REASON.search(line.text)
        if match:
            name = clipped(match.group(1))
            count = found[name].count if name in found else 0
            found[name] = ConflictSeen(count + 1, max(0.0, now - line.time))
    return found
