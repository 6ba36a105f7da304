"""Capsules as text: whether one is intact, and tables of trials.

All texts of an index are printable, but the values of parameters.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from swarmctl.capsule.capsule_index import Index, Judged
from swarmctl.capsule.comparison import Compared
from swarmctl.capsule.completion_rate import Rate
from swarmctl.views.escape import printable

_LONGEST = 60  # characters of a parameter's value, which may be a whole file
_COLOURS = {"completed": "green", "interrupted": "yellow", "failed": "red"}


def verdict(signer: str, problems: Sequence[str]) -> str:
    """Returns whether a capsule is intact and who signed it, or what is wrong, in one line."""
    if problems:
        return "; ".join(problems)
    return f"intact, signed by {signer}" if signer else "intact, not signed"


def trials(found: Sequence[Index], rates: Mapping[tuple[str, str], Rate]) -> Group:
    """Returns a row per trial, and below how many of each experiment were completed."""
    shown = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("EXPERIMENT", "TRIAL", "BEGAN", "SECONDS", "OUTCOME", "SKEW ms", "CAUSE"):
        numeric = title in ("TRIAL", "SECONDS", "SKEW ms")
        shown.add_column(title, justify="right" if numeric else "left", overflow="fold")
    for one in found:
        shown.add_row(
            one.experiment, str(one.trial), _local(one.began), f"{one.ended - one.began:.1f}",
            Text("succeeded" if one.success else one.outcome, _COLOURS[one.outcome]),
            "-" if one.skew is None else f"{1000 * one.skew:.1f}", Text(one.cause or unmet(one.judged)),
        )  # fmt: skip
    return Group(shown, "", *(Text(f"{swarm} {name}: {rate(one)}") for (swarm, name), one in rates.items()))


def unmet(judged: Sequence[Judged]) -> str:
    """Returns which conditions are not met, as ``k3/odom: distance is 0.21, not 0.3``; empty if all are."""
    found = (("unknown" if one.found is None else f"{one.found:.3g}", one) for one in judged if not one.met)
    return "; ".join(f"{one.topic}: {one.condition} is {what}, not {one.wanted:g}" for what, one in found)


def comparison(found: Sequence[Compared]) -> Group:
    """Returns a row per experiment with its parameters, and below how often each cause made trials fail."""
    shown = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("SWARM", "EXPERIMENT", "PARAMETERS"):
        shown.add_column(title, overflow="fold")
    for title in ("TRIALS", "COMPLETED", "SUCCESS", "95 % INTERVAL", "MEDIAN s"):
        shown.add_column(title, justify="right")
    causes = []
    for one in found:
        name, parameters = one.experiment, parameters_text(one.parameters)
        low, high = (round(100 * end) for end in one.interval())
        shown.add_row(
            one.swarm, name, parameters, str(one.trials), str(one.completed),
            f"{round(100 * one.succeeded / one.trials)} %", f"{low}-{high} %", f"{one.seconds:.1f}",
        )  # fmt: skip
        group = " ".join(filter(None, (one.swarm, name, parameters)))
        causes += [Text(f"{group}: {number} x {cause}") for cause, number in one.causes.items()]
    return Group(shown, *([""] if causes else []), *causes)


def parameters_text(parameters: Mapping[str, Mapping[str, Any]]) -> str:
    """Returns parameters of programs as ``square.speed=0.1 square.side=0.3``."""
    values = (
        (f"{program}.{name}", one) for program, inner in parameters.items() for name, one in inner.items()
    )
    return " ".join(
        f"{name}={printable(one if isinstance(one, str) else json.dumps(one))[:_LONGEST]}"
        for name, one in values
    )


def rate(found: Rate) -> str:
    """Returns how many trials were completed, as ``7 of 10 completed (70 %, 95 % interval 40-89 %)``."""
    low, high = (round(100 * end) for end in found.interval())
    share = round(100 * found.completed / found.trials)
    return f"{found.completed} of {found.trials} completed ({share} %, 95 % interval {low}-{high} %)"


def _local(moment: float) -> str:
    return datetime.fromtimestamp(moment, tz=timezone.utc).astimezone().strftime("%Y-%m-%d %H:%M:%S")
