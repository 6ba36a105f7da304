"""Capsules as text: whether one is intact, and a table of trials. All texts of an index are printable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, timezone

from rich.console import Group
from rich.table import Table
from rich.text import Text

from swarmctl.capsule.capsule_index import Index
from swarmctl.capsule.completion_rate import Rate

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
            Text(one.outcome, _COLOURS[one.outcome]), "-" if one.skew is None else f"{1000 * one.skew:.1f}",
            Text(one.cause),
        )  # fmt: skip
    return Group(shown, "", *(Text(f"{swarm} {name}: {rate(one)}") for (swarm, name), one in rates.items()))


def rate(found: Rate) -> str:
    """Returns how many trials were completed, as ``7 of 10 completed (70 %, 95 % interval 40-89 %)``."""
    low, high = (round(100 * end) for end in found.interval())
    share = round(100 * found.completed / found.trials)
    return f"{found.completed} of {found.trials} completed ({share} %, 95 % interval {low}-{high} %)"


def _local(moment: float) -> str:
    return datetime.fromtimestamp(moment, tz=timezone.utc).astimezone().strftime("%Y-%m-%d %H:%M:%S")
