"""The impact of failures as text: the worst first."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from swarmctl.analysis.impact import Impact

_NAMED = 4  # names of one list that are shown; the rest are counted


def table(impacts: Sequence[Impact]) -> Table:
    """One row for each part whose failure affects others."""
    made = Table(box=None, show_edge=False, pad_edge=False)
    made.add_column("if this fails", no_wrap=True)
    made.add_column("robots lost", justify="right")
    made.add_column("what fails with it")
    for one in impacts:
        if not one.harmless:
            style = "bold red" if one.single_point else ""
            made.add_row(Text(f"{one.kind} {one.name}", style), _count(one), losses(one))
    return made


def losses(impact: Impact) -> str:
    """`koala loses its driver; k3, epuck lose command; island newswarm loses its master`."""
    parts = [
        _who(impact.drivers, "loses its driver", "lose their drivers"),
        _who(impact.command, "loses command", "lose command"),
        _who([f"island {one}" for one in impact.masters], "loses its master", "lose their masters"),
        _who(impact.programs, "ends", "end"),
        _who([f"{topic} for {program}" for topic, program in impact.data], "is lost", "are lost"),
    ]
    return "; ".join(part for part in parts if part)


def _who(names: Sequence[str], one: str, several: str) -> str:
    if not names:
        return ""
    shown = ", ".join(names[:_NAMED])
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{shown}{more} {one if len(names) == 1 else several}"


def _count(impact: Impact) -> str:
    spared = len(impact.robots) - len(impact.missed)
    return f"{len(impact.missed)}{f' + {spared} optional' if spared else ''}"
