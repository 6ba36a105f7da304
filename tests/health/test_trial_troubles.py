"""What keeps a trial from its begin, and what makes one fail, by the looks before and after it."""

from __future__ import annotations

import pytest

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.swarm_health import Look, status
from swarmctl.health.trial_troubles import before_it, in_it
from tests.health.swarm_values import K3_PI, UNIT, Spoil, all_well, graph, with_unit

K3 = UNIT["k3"]


def look(spoil: Spoil = lambda answer: answer) -> Look:
    answers = all_well()
    answers[K3_PI] = spoil(answers[K3_PI])
    return Look(status(graph(), answers, diagnose(graph(), answers)), 0.0, 0.0)


def test_a_healthy_swarm_has_no_trouble() -> None:
    assert list(before_it(look(), ())) == list(in_it(look(), look(), ())) == []


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (with_unit(K3, active="failed", sub="failed"), "the swarm is not healthy: unit "),
        (lambda answer: answer._replace(release="0" * 16), "release k3-pi: "),
        (lambda answer: answer._replace(clock_ahead=2.0), "clock k3-pi: "),
    ],
    ids=["sick", "another release", "another clock"],
)
def test_a_trial_needs_a_healthy_swarm_with_the_spec_and_one_clock(spoil: Spoil, words: str) -> None:
    assert next(iter(before_it(look(spoil), ()))).startswith(words)


def test_a_driver_that_was_started_again_is_named_though_all_is_well() -> None:
    after = look(with_unit(K3, pid=43))
    assert not list(before_it(after, ()))
    assert list(in_it(look(), after, ())) == ["the driver of k3 ended in the trial, and was started again"]


def test_a_swarm_that_is_sick_afterwards_is_its_cause() -> None:
    (cause,) = in_it(look(), look(with_unit(K3, active="failed", sub="failed")), ())
    assert cause.startswith("unit ")
