"""How many trials of an experiment were completed, and what that shows of the next ones."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt
from typing import NamedTuple

from swarmctl.capsule.capsule_index import Index

_Z = 1.959964  # the 97.5 % quantile of the normal distribution: 95 % lie between it and its negative


class Rate(NamedTuple):
    """Trials of an experiment: those that were completed, and all."""

    completed: int
    trials: int

    def interval(self) -> tuple[float, float]:
        """Returns the 95 % interval of the probability that a trial is completed, by Wilson's score.

        With p = completed / trials, n = trials and z = 1.96, its ends are
        (p + z²/2n ± z √(p(1 - p)/n + z²/4n²)) / (1 + z²/n).
        E. B. Wilson, "Probable inference, the law of succession, and statistical inference", Journal of the
        American Statistical Association 22 (1927), 209-212. It holds for few trials, too.
        """
        share, square = self.completed / self.trials, _Z * _Z / self.trials
        middle = share + square / 2
        half = sqrt(share * (1 - share) * square + square * square / 4)
        return max(0.0, (middle - half) / (1 + square)), min(1.0, (middle + half) / (1 + square))


def rates(trials: Iterable[Index]) -> dict[tuple[str, str], Rate]:
    """Returns the rate of each experiment, by the names of its swarm and its own, in order."""
    found: dict[tuple[str, str], Rate] = {}
    for one in trials:
        key = one.swarm, one.experiment
        before = found.get(key, Rate(0, 0))
        found[key] = Rate(before.completed + (one.outcome == "completed"), before.trials + 1)
    return found
