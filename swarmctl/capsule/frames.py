"""Trials and how their robots moved, as data frames of pandas."""

from __future__ import annotations

import json
import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pandas

from swarmctl.capsule.bag_topics import read as read_topics
from swarmctl.capsule.capsule_index import Index
from swarmctl.capsule.comparison import succeeded
from swarmctl.capsule.folder import below, read

_TRIAL = (
    "folder", "swarm", "experiment", "trial", "began", "seconds", "outcome", "cause", "success", "skew",
    "operator", "commit",
)  # fmt: skip
_SAMPLE = ("folder", "topic", "t", "x", "y", "yaw", "speed")


def trials(folders: Iterable[str | Path]) -> pandas.DataFrame:
    """Returns a row per trial of the capsules in these folders, or at most two folders below.

    ``began`` is in s since 1970, ``seconds`` and ``skew`` in s. ``success`` is whether it was completed
    where nothing judged it. Parameters are ``program.param``; a judged condition, as ``k3/odom reached``,
    has what was found: m, or messages. Raises ``CapsuleError``.
    """
    rows = [_row(folder, read(folder)) for folder in _capsules(folders)]
    columns = dict.fromkeys((*_TRIAL, *(name for row in rows for name in row)))
    return pandas.DataFrame(rows, columns=list(columns))


def samples(
    folders: Iterable[str | Path], trouble: Callable[[str], object] = warnings.warn
) -> pandas.DataFrame:
    """Returns a row per message with a pose in the bags of the capsules, as they are recorded.

    ``t`` is in s since the trial began, ``x`` and ``y`` in m, ``yaw`` in rad, ``speed`` in m/s. ``trouble``
    gets what is wrong with each bag that cannot be read. Raises ``CapsuleError``.
    """
    rows: list[tuple[Any, ...]] = []
    for folder in _capsules(folders):
        index, found = read(folder), read_topics(folder / "bags")
        for one in found.troubles:
            trouble(one)
        for name, topic in sorted(found.topics.items()):
            began = index.start(topic.recorder)
            rows += [(str(folder), name, round(one.t - began, 6), *one[1:]) for one in topic.samples]
    return pandas.DataFrame(rows, columns=list(_SAMPLE))


def _capsules(folders: Iterable[str | Path]) -> list[Path]:
    return list(dict.fromkeys(one for folder in map(Path, folders) for one in below(folder) or [folder]))


def _row(folder: Path, trial: Index) -> dict[str, Any]:
    fixed = (
        str(folder), trial.swarm, trial.experiment, trial.trial, trial.began, trial.ended - trial.began,
        trial.outcome, trial.cause, succeeded(trial), trial.skew, trial.operator,
        trial.git and trial.git.commit,
    )  # fmt: skip
    row = dict(zip(_TRIAL, fixed, strict=True))
    for program, parameters in trial.parameters.items():
        for name, value in parameters.items():
            row[f"{program}.{name}"] = value if isinstance(value, bool | int | float) else _text(value)
    times = Counter[str]()
    for one in trial.judged:
        name = f"{one.topic} {one.condition}"
        times[name] += 1
        row[name if times[name] == 1 else f"{name} {times[name]}"] = one.found
    return row


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
