"""What the server sends to the pages, as JSON data. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from swarm_onboard.agent.verbs.telemetry import Telemetry

from swarmctl.health.host_logs import Entry, Merge
from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import Status
from swarmctl.health.verdict import State
from swarmctl.spec.model import Spec
from swarmctl.views import logs as view

_MOST_LINES = 200  # of a log


def status(seen: Status, age: float) -> dict[str, Any]:
    """A status, of which the oldest answer of a host is ``age`` s old; its causes, the worst first."""
    return {
        "status": seen.to_json(),
        "causes": [
            {**_finding(cause), "symptoms": [_finding(one) for one in symptoms]}
            for cause, symptoms in seen.causes()
            if cause.state is not State.SKIPPED
        ],
        "age": age,
    }


def telemetry(note: Telemetry) -> dict[str, Any]:
    """How the robots of a host move, whose device is missing, and the trial that goes on there."""
    robots = {name: one._asdict() for name, one in note.robots.items()}
    return {"robots": robots, "missing": note.missing, "trial": note.trial, "left": note.left}


def _finding(one: Finding) -> dict[str, Any]:
    return asdict(one) | {"key": one.key}


def log(node: str, entries: Iterable[Entry]) -> dict[str, Any]:
    """The log of a node of the graph, in the order of time."""
    merge = Merge()
    for entry in entries:
        merge.add(entry, 0.0)
    lines = [{"level": one.level, "text": view.lines(one).plain} for one in merge.rest()]
    return {"node": node, "lines": lines, "trouble": ""}


def log_of(node: str, entries: Iterable[Entry]) -> dict[str, Any]:
    """The log of a node, out of the entries of all."""
    kind, _, name = node.partition(":")
    named = [one for one in entries if name == (one.host if kind == "host" else one.source.partition("/")[0])]
    return log(node, named[-_MOST_LINES:])


def starts(spec: Spec) -> dict[str, tuple[float, float, float]]:
    """Where robots stand in the map when their drivers start, as far as the spec says: m, m and rad."""
    return {
        name: (robot.start.x, robot.start.y, math.radians(robot.start.heading_deg))
        for name, robot in spec.robots.items()
        if robot.start is not None
    }
