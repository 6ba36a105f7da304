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

if TYPE_CHECKING:
    from swarm_onboard.agent.probe_messages import ConflictAnswer, ProbeAnswer

_OF_PYTHON = "shutdown request: "  # begins that line of rospy and of the drivers
_TAKEN = "Reason: new node registered with same name"
_REASON = re.compile(rf"\[(/[^\]\s]+)\] {_TAKEN}")
_MOST_UNITS = 20  # whose logs are read
_LONGEST = 10.0  # s for all logs


def add(answer: ProbeAnswer) -> None:
    """Adds the conflicts of the units that logged one, were restarted, do not run, or have lost a node.

    The states of the units are the last ones of the probe: one that was ended during it counts, too.
    """
    began = time.monotonic()
    answer["conflicts"] = {}
    try:
        for unit, since in _suspicious(answer)[:_MOST_UNITS]:
            if time.monotonic() - began > _LONGEST:
                answer["troubles"]["conflicts"] = "the logs of the units took too long to read"
                return
            found = conflicts_in(unit_journal.messages(unit, since), time.time())
            if found:
                answer["conflicts"][unit] = found
    except RefusedError as error:
        answer["troubles"]["conflicts"] = clipped(error.message)


def _suspicious(answer: ProbeAnswer) -> list[tuple[str, float]]:
    """Units to look at, each with the time from which on its log counts. Raises RefusedError."""
    history = answer.get("history") or {}
    since = min((one["since"] for one in history.values()), default=0.0)
    texts = [f"{_OF_PYTHON}[{node}] {_TAKEN}" for node in answer.get("nodes") or {}]
    requested = unit_journal.units_with(texts, since)
    units, launched = answer.get("units") or {}, answer.get("launched") or {}
    lost = {
        unit for unit, one in launched.items() if one["ended"] or max(one["starts"].values(), default=1) > 1
    }
    restarted = {unit for unit, state in units.items() if state["restarted"] or state["active"] != "active"}
    return [
        (unit, one["since"])
        for unit, one in history.items()
        if unit in requested or unit in lost or unit in restarted or one["recent"]
    ]


def conflicts_in(lines: Iterable[unit_journal.Message], now: float) -> dict[str, ConflictAnswer]:
    """How often each node was ended by another of its name, and how long before ``now``, s."""
    found: dict[str, ConflictAnswer] = {}
    for line in lines:
        match = _REASON.search(line.text)
        if match:
            name = clipped(match.group(1))
            count = found[name]["count"] if name in found else 0
            found[name] = {"count": count + 1, "ago": max(0.0, now - line.time)}
    return found
