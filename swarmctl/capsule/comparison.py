"""Trials compared by their experiment and its parameters. Pure."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any

from swarmctl.capsule.capsule_index import Index
from swarmctl.capsule.completion_rate import Rate


@dataclass(frozen=True)
class Compared:
    """Trials of one experiment with the same parameters; ``seconds``: the median of their durations.

    ``causes``: why trials are no success, with their number, the most frequent first.
    """

    swarm: str
    experiment: str
    parameters: Mapping[str, Mapping[str, Any]]
    trials: int
    completed: int
    succeeded: int
    seconds: float
    causes: Mapping[str, int]

    def interval(self) -> tuple[float, float]:
        """Returns the 95 % interval of the probability that a trial succeeds, by Wilson's score."""
        return Rate(self.succeeded, self.trials).interval()


def compare(trials: Iterable[Index]) -> list[Compared]:
    """Returns a row by swarm, experiment and parameters, each in the order of their first trials."""
    groups: dict[tuple[str, str, str], list[Index]] = {}
    for one in sorted(trials, key=lambda one: (one.swarm, one.experiment, one.began)):
        parameters = json.dumps(one.model_dump(mode="json")["parameters"], sort_keys=True)
        groups.setdefault((one.swarm, one.experiment, parameters), []).append(one)
    return [
        Compared(
            swarm, experiment, group[0].parameters, len(group),
            sum(one.outcome == "completed" for one in group),
            sum(map(succeeded, group)),
            median(one.ended - one.began for one in group),
            dict(Counter(cause for one in group for cause in _causes(one)).most_common()),
        )
        for (swarm, experiment, _), group in groups.items()
    ]  # fmt: skip


def succeeded(trial: Index) -> bool:
    """Returns whether a trial is a success; without a judgement, whether it was completed."""
    return trial.outcome == "completed" if trial.success is None else trial.success


def _causes(trial: Index) -> Iterator[str]:
    if trial.outcome != "completed":
        yield trial.cause or trial.outcome
    elif not succeeded(trial):
        unmet = [f"{one.topic}: {one.condition} is not met" for one in trial.judged if not one.met]
        yield from dict.fromkeys(unmet or ["no success"])
