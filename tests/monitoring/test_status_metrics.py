"""The metrics of a status: what is measured has a sample, what is not has none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families

from swarmctl.health.swarm_health import Look
from swarmctl.remote.transport import HostError, Kind
from swarmctl.views.status_metrics import MOST_FINDINGS, render
from tests.health.swarm_values import (
    EPUCK_PI,
    K3_PI,
    LAPTOP,
    UNIT,
    all_well,
    changed,
    nothing_deployed,
    with_master,
    with_topic,
)
from tests.monitoring.looks import AWAY, look_at, troubled, with_hostile_findings

GOLDEN = Path(__file__).parent / "golden"
Labels = dict[str, str]


def samples(look: Look, name: str) -> list[tuple[Labels, float]]:
    """The samples of a metric as Prometheus's own format is read, without the label of the swarm."""
    families = text_string_to_metric_families(render(look).decode())
    found = [one for family in families for one in family.samples if one.name == name]
    assert all(one.labels.pop("swarm") == look.status.swarm for one in found)
    return [(one.labels, one.value) for one in found]


def by_host(look: Look, name: str) -> dict[str, float]:
    return {labels["host"]: value for labels, value in samples(look, name)}


def test_a_healthy_swarm_has_no_findings() -> None:
    look = look_at(all_well())
    assert samples(look, "swarm_healthy") == [({}, 1)]
    assert samples(look, "swarm_finding") == []
    assert samples(look, "swarm_look_timestamp_seconds") == [({}, 1_700_000_000)]
    assert samples(look, "swarm_look_duration_seconds") == [({}, 2.5)]
    assert by_host(look, "swarm_host_up") == {LAPTOP: 1, K3_PI: 1, EPUCK_PI: 1}
    assert by_host(look, "swarm_host_units_running") == by_host(look, "swarm_host_units_expected")
    assert set(by_host(look, "swarm_host_release_as_expected").values()) == {1}
    assert by_host(look, "swarm_master_latency_seconds") == {LAPTOP: 0.0008, K3_PI: 0.0041, EPUCK_PI: 0.0041}
    assert samples(look, "swarm_robot_commander_info") == []


@pytest.mark.parametrize("make", [all_well, troubled])
def test_the_text_is_the_golden_one(make: Callable[[], dict[str, object]], golden: Callable) -> None:
    golden(GOLDEN / f"{make.__name__}.prom", render(look_at(make())).decode())


def test_a_host_that_is_away_has_no_measurements() -> None:
    look = look_at({**all_well(), K3_PI: AWAY})
    assert by_host(look, "swarm_host_up")[K3_PI] == 0
    text = render(look).decode()
    known = [line for line in text.splitlines() if f'host="{K3_PI}"' in line]
    expected = (
        "swarm_host_up",
        "swarm_host_units_expected",
        "swarm_topic_expected_rate_hertz",
        "swarm_finding",
    )
    assert {line.partition("{")[0] for line in known} == set(expected)


def test_a_host_that_was_not_tried_is_not_down() -> None:
    look = look_at({**all_well(), K3_PI: HostError(Kind.STOPPED, "stopped")})
    assert by_host(look, "swarm_host_up") == {LAPTOP: 1, EPUCK_PI: 1}


def test_a_symptom_has_its_cause() -> None:
    found = samples(look_at(troubled()), "swarm_finding")
    causes = {labels["check"]: labels["cause"] for labels, _ in found if labels["host"] == K3_PI}
    assert causes.pop("device") == ""
    assert causes
    assert set(causes.values()) == {"device k3"}
    assert {labels["state"] for labels, _ in found} <= {"bad", "unknown", "warning"}


def test_what_a_reachable_host_did_not_measure_has_no_sample() -> None:
    answers = all_well()
    dark = {**answers[K3_PI].troubles, "units": "timed out", "release": "timed out"}
    blind = changed(units={}, release=None, troubles=dark)(with_master(reachable=False)(answers[K3_PI]))
    silent = with_topic("k3", "/k3/odom", error="refused", count=0, rate=None)(blind)
    look = look_at({**answers, K3_PI: silent})
    for name in ("units_running", "release_as_expected"):
        assert K3_PI not in by_host(look, f"swarm_host_{name}")
    assert K3_PI not in by_host(look, "swarm_master_latency_seconds")
    assert K3_PI not in by_host(look, "swarm_unit_restarts_total")
    rated = {one["topic"] for one, _ in samples(look, "swarm_topic_rate_hertz")}
    assert "/k3/battery" in rated
    assert "/k3/odom" not in rated


@pytest.mark.parametrize(("seconds", "rated"), [(0.01, False), (2.0, True)])
def test_a_topic_too_slow_for_the_window_has_no_rate(seconds: float, rated: bool) -> None:
    answers = all_well()
    silent = with_topic("k3", "/k3/odom", count=0, rate=None, seconds=seconds)(answers[K3_PI])
    found = samples(look_at({**answers, K3_PI: silent}), "swarm_topic_rate_hertz")
    assert [value for one, value in found if one["topic"] == "/k3/odom"] == [0] * rated


def test_a_host_without_a_release_is_measured_so() -> None:
    answers = all_well()
    look = look_at({**answers, K3_PI: nothing_deployed(answers[K3_PI])})
    assert by_host(look, "swarm_host_release_as_expected") == {LAPTOP: 1, K3_PI: 0, EPUCK_PI: 1}
    assert by_host(look, "swarm_host_units_running")[K3_PI] == 0
    assert K3_PI not in by_host(look, "swarm_unit_restarts_total")


def test_restarts_and_the_commander() -> None:
    look = look_at(troubled())
    restarts = {one["unit"]: value for one, value in samples(look, "swarm_unit_restarts_total")}
    assert restarts[UNIT["koala"]] == 2
    obeyed = {"host": LAPTOP, "robot": "koala", "commander": "laptop"}
    assert samples(look, "swarm_robot_commander_info") == [(obeyed, 1)]
    ages = {one["topic"]: value for one, value in samples(look, "swarm_topic_last_message_age_seconds")}
    assert ages == {"/koala/odom": 0.05}


def test_text_of_hosts_is_one_label_and_short() -> None:
    hostile = ['a"} 1\nswarm_healthy{swarm="x', "\ud800\x1b[2J\u202e", "x" * 100_000, "x" * 100_001]
    look = with_hostile_findings(look_at(all_well()), [*hostile, hostile[0]])
    found = [labels["subject"] for labels, _ in samples(look, "swarm_finding")]
    assert len(found) == len(set(found)) == len(hostile)
    assert all(one.isprintable() and len(one) < 150 for one in found)
    assert samples(look, "swarm_healthy") == [({}, 0)]


def test_a_host_has_a_bounded_number_of_findings() -> None:
    look = with_hostile_findings(look_at(all_well()), [f"node {number}" for number in range(5_000)])
    assert len(samples(look, "swarm_finding")) == MOST_FINDINGS
    assert [value for _, value in samples(look, "swarm_findings_left_out")] == [5_000 - MOST_FINDINGS]


def test_causes_stay_when_symptoms_are_left_out() -> None:
    look = with_hostile_findings(look_at(all_well()), [f"node {number}" for number in range(5_000)])
    *symptoms, last = look.status.diagnosis.findings
    findings = (*(replace(one, cause=last.key) for one in symptoms), last)
    look = replace(
        look, status=replace(look.status, diagnosis=replace(look.status.diagnosis, findings=findings))
    )
    assert samples(look, "swarm_finding")[0][0]["subject"] == last.subject
