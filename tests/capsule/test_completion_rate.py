"""Wilson's interval against published values, and how trials are counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.capsule.completion_rate import Rate, rates
from swarmctl.capsule.folder import write
from swarmctl.views.capsule import rate
from tests.capsule.trial_folder import ABOUT, filled

#: Newcombe, "Two-sided confidence intervals for the single proportion", Statistics in Medicine 17 (1998),
#: table I, method 3.
PUBLISHED = {
    (81, 263): (0.2553, 0.3662),
    (15, 148): (0.0624, 0.1605),
    (0, 20): (0, 0.1611),
    (1, 29): (0.0061, 0.1718),
}


@pytest.mark.parametrize("counted", PUBLISHED)
def test_the_interval_is_the_published_one(counted: tuple[int, int]) -> None:
    assert Rate(*counted).interval() == pytest.approx(PUBLISHED[counted], abs=5e-5)


def test_the_interval_is_symmetric_and_within_bounds() -> None:
    for trials in range(1, 40):
        for completed in range(trials + 1):
            low, high = Rate(completed, trials).interval()
            assert 0 <= low < high <= 1
            assert low - 1e-9 < completed / trials < high + 1e-9
            assert Rate(trials - completed, trials).interval() == pytest.approx((1 - high, 1 - low), abs=1e-9)


def test_the_line_has_counts_share_and_interval() -> None:
    assert rate(Rate(7, 10)) == "7 of 10 completed (70 %, 95 % interval 40-89 %)"
    assert rate(Rate(0, 1)) == "0 of 1 completed (0 %, 95 % interval 0-79 %)"


def test_each_experiment_of_each_swarm_is_counted(tmp_path: Path) -> None:
    index = write(filled(tmp_path), ABOUT)
    changes = (
        {},
        {"outcome": "failed"},
        {"outcome": "interrupted"},
        {"experiment": "line"},
        {"swarm": "yard"},
    )
    assert rates(index.model_copy(update=one) for one in changes) == {
        ("lab", "circle"): (1, 3), ("lab", "line"): (1, 1), ("yard", "circle"): (1, 1),
    }  # fmt: skip
