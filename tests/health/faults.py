"""A fault on a host, and what `diagnose` must make of it; the tables stand in `test_*_faults.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.root_cause import Diagnosis
from swarmctl.remote.transport import HostError, Kind
from tests.health.swarm_values import K3_PI, UNIT, WLAN, Spoil, all_well, graph

AWAY = HostError(Kind.UNREACHABLE, "connect timed out", "is it on?")

K3_TOPICS = [f"topic /k3/{sensor} of k3" for sensor in ("odom", "proximity", "ground", "battery")]
UNIT_K3 = f"unit {UNIT['k3']} on {K3_PI}"
UNIT_WLAN = f"unit {WLAN} on {K3_PI}"


@dataclass(frozen=True)
class Fault:
    """A fault on one host, and what is made of it."""

    host: str
    spoil: Spoil
    causes: Mapping[str, tuple[str, list[str]]]
    healthy: bool = False
    message: str = ""


def spoilt(host: str, spoil: Spoil) -> dict[str, Any]:
    answers = all_well()
    return {**answers, host: spoil(answers[host])}


def shape(found: Diagnosis) -> dict[str, tuple[str, list[str]]]:
    """Every cause that is not ok: its state, and the keys of its symptoms."""
    return {
        cause.key: (cause.state.value, [one.key for one in symptoms]) for cause, symptoms in found.explained()
    }


def check(fault: Fault) -> None:
    found = diagnose(graph(), spoilt(fault.host, fault.spoil))
    assert shape(found) == fault.causes
    assert found.healthy is fault.healthy
    assert any(fault.message in cause.message for cause, _ in found.explained()) or not fault.causes
