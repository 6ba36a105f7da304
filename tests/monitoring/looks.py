"""Looks at the example swarm, made without hosts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from swarm_onboard.agent.observations import Report

from swarmctl.health import swarm_health
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.swarm_health import Look
from swarmctl.remote.transport import HostError, Kind
from tests.health.swarm_values import (
    EPUCK_PI,
    K3_PI,
    LAPTOP,
    UNIT,
    all_well,
    both,
    graph,
    no_serial_port,
    with_node,
    with_topic,
    with_unit,
)

AWAY = HostError(Kind.UNREACHABLE, "connect timed out")


def look_at(outcomes: dict[str, Any], began: float = 1_700_000_000.0) -> Look:
    status = swarm_health.status(graph(), outcomes, diagnose(graph(), outcomes))
    return Look(status, began, 2.5)


def troubled() -> dict[str, Any]:
    """A host is away, a cable is out, a unit was restarted, a robot is commanded, a topic has an age."""
    answers = all_well()
    return {
        **answers,
        EPUCK_PI: AWAY,
        K3_PI: no_serial_port("k3")(answers[K3_PI]),
        LAPTOP: both(
            with_unit(UNIT["koala"], restarts=2),
            with_node("koala", report=Report(0, "drives", commander="laptop")),
            with_topic("koala", "/koala/odom", age=0.05),
        )(answers[LAPTOP]),
    }


def with_hostile_findings(look: Look, subjects: list[str]) -> Look:
    """The look, with findings about names that a host has chosen."""
    first = look.status.diagnosis.findings[0]
    bad = swarm_health.State.BAD
    findings = tuple(replace(first, check="leak", subject=one, state=bad) for one in subjects)
    diagnosis = replace(look.status.diagnosis, findings=findings)
    return replace(look, status=replace(look.status, diagnosis=diagnosis))
