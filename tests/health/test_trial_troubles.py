"""What makes a trial fail, by the looks before and after it."""

from __future__ import annotations

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.swarm_health import Look, status
from swarmctl.health.trial_troubles import in_it
from tests.health.swarm_values import K3_PI, UNIT, Spoil, all_well, graph, with_unit

K3 = UNIT["k3"]


def look(spoil: Spoil = lambda answer: answer) -> Look:
    answers = all_well()
    answers[K3_PI] = spoil(answers[K3_PI])
    return Look(status(graph(), answers, diagnose(graph(), answers)), 0.0, 0.0)


def test_a_healthy_swarm_has_no_trouble() -> None:
    assert list(in_it(look(), look(), ())) == []


def test_a_driver_that_was_started_again_is_named_though_all_is_well() -> None:
    after = look(with_unit(K3, pid=43))
    assert after.status.diagnosis.healthy
    assert list(in_it(look(), after, ())) == ["the driver of k3 ended in the trial, and was started again"]


def test_a_swarm_that_is_sick_afterwards_is_its_cause() -> None:
    (cause,) = in_it(look(), look(with_unit(K3, active="failed", sub="failed")), ())
    assert cause.startswith("unit ")
