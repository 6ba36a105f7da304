"""The topics of a stand-in come at their rates, whatever the step of its body."""

from __future__ import annotations

import pytest
from swarm_onboard.stand_in.body import STEP, Schedule


def sent(rates: list[float], seconds: float, late: float = 0.0002) -> list[int]:
    """How many messages each topic has after ``seconds`` if each sleep is ``late`` seconds too long."""
    schedule, now, counts = Schedule(rates, 0.0), 0.0, [0] * len(rates)
    while now < seconds:
        for index in schedule.ready(now):
            counts[index] += 1
        now += schedule.pause(now) + late
    return counts


def test_every_topic_comes_at_its_rate() -> None:
    rates = [100.0, 30.0, 1.0, 250.0]
    assert sent(rates, 10.0) == [pytest.approx(10 * rate, rel=0.01, abs=1) for rate in rates]


def test_a_topic_without_rate_comes_once() -> None:
    assert sent([0.0, 50.0], 2.0)[0] == 1


def test_a_late_topic_catches_up_with_one_message() -> None:
    schedule = Schedule([100.0], 0.0)
    assert schedule.ready(3.0) == [0]
    assert schedule.ready(3.0) == [0]
    assert schedule.ready(3.0) == []


def test_the_body_moves_in_short_steps_while_nothing_is_due() -> None:
    schedule = Schedule([0.0, 1.0], 0.0)
    schedule.ready(0.0)
    assert schedule.pause(0.0) == STEP
    assert Schedule([], 0.0).pause(0.0) == STEP
