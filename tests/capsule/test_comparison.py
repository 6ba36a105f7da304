"""Trials of one experiment with other parameters are compared."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.capsule.capsule_index import Index, Judged
from swarmctl.capsule.comparison import compare
from swarmctl.capsule.completion_rate import Rate
from swarmctl.capsule.folder import write
from tests.capsule.trial_folder import ABOUT, filled

UNMET = Judged(topic="k3/odom", condition="reached", wanted=0.1, found=0.4, met=False)
MET = Judged(topic="k3/odom", condition="count", wanted=10, found=12, met=True)


@pytest.fixture
def index(tmp_path: Path) -> Index:
    return write(filled(tmp_path), ABOUT)


def test_rows_are_by_experiment_and_parameters(index: Index) -> None:
    slow, fast = {"wander": {"speed": 0.1, "seed": 1}}, {"wander": {"seed": 1, "speed": 0.2}}
    changes = (
        {"parameters": fast, "began": 20.0, "ended": 30.0},
        {"parameters": slow, "began": 10.0, "ended": 22.0},
        {"parameters": {"wander": {"seed": 1, "speed": 0.1}}, "began": 50.0, "ended": 60.0},
        {"parameters": slow, "began": 70.0, "ended": 170.0, "outcome": "failed", "cause": "k3 fell"},
        {"experiment": "line"},
        {"swarm": "yard"},
    )
    rows = compare(index.model_copy(update=one) for one in changes)
    assert [(one.swarm, one.experiment, one.parameters, one.trials) for one in rows] == [
        ("lab", "circle", slow, 3), ("lab", "circle", fast, 1),
        ("lab", "line", {}, 1), ("yard", "circle", {}, 1),
    ]  # fmt: skip
    assert (rows[0].completed, rows[0].succeeded, rows[0].seconds) == (2, 2, 12.0)
    assert rows[0].interval() == Rate(2, 3).interval()


def test_a_trial_is_judged_by_success_else_by_its_outcome(index: Index) -> None:
    changes = ({}, {"success": True}, {"success": False}, {"outcome": "interrupted", "cause": "Ctrl-C"})
    (row,) = compare(index.model_copy(update=one) for one in changes)
    assert (row.trials, row.completed, row.succeeded) == (4, 3, 2)


def test_causes_are_counted_the_most_frequent_first(index: Index) -> None:
    failed = {"outcome": "failed", "success": False}
    changes = (
        {},
        failed | {"cause": "k3 fell", "judged": [UNMET]},
        {"success": False, "judged": [UNMET, UNMET, MET]},
        {"success": False, "judged": [UNMET]},
        failed | {"cause": ""},
    )
    (row,) = compare(index.model_copy(update=one) for one in changes)
    assert list(row.causes.items()) == [("k3/odom: reached is not met", 2), ("k3 fell", 1), ("failed", 1)]
