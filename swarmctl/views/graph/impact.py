"""The impact of failures as text: the worst first."""

from __future__ import annotations

import re
from collections.abc import Sequence

from rich.cells import cell_len
from rich.table import Table
from rich.text import Text

from swarmctl.analysis.impact import Impact
from swarmctl.views.equal_hosts import FEW, grouped
from swarmctl.yamltext import hostlist

NUMBER = re.compile(r"(?<=[\w\[/,-])\d+")  # of a name or a range; counts stand behind a blank
_PROGRAM = "program"
_WIDEST, _NARROWEST = 30, 40  # columns of a part, and of what fails beside it; in fewer it stands below
_NAMED = 4  # names and ranges of one list that are shown; the rest are counted


def table(impacts: Sequence[Impact], *, details: bool = False, width: int | None = None) -> Table | Text:
    """One row for each program, and for each other part whose failure affects something.

    Parts that differ only in numbers of names share a row, and so do programs that end alone, unless with
    ``details``. Where few columns are left for what fails, it stands below each part.
    """
    programs = any(one.programs or one.kind == _PROGRAM for one in impacts)
    counted = ("robots lost", "programs") if programs else ("robots lost",)
    shown = [one for one in impacts if one.kind == _PROGRAM or not one.harmless]
    rows = []
    for group in grouped(shown, _pattern, alone=lambda group: details or _is_alone(group)):
        first = group[0]
        style = "bold red" if first.single_point else ""
        lost = "nothing else" if first.harmless else losses(first)
        like = f"{len(group)} like {first.name}: " if len(group) > 1 and not first.harmless else ""
        part = Text(f"{first.kind} {hostlist.written(one.name for one in group)}", style)
        rows.append((part, _counts(first, programs), f"{like}{lost}"))
    longest = max((cell_len(part.plain) for part, *_ in rows), default=0)
    if (
        width is not None
        and min(longest, _WIDEST) + sum(len(one) + 2 for one in counted) + _NARROWEST > width
    ):
        return Text("\n").join(_stacked(*row, counted) for row in rows)
    made = Table(box=None, show_edge=False, pad_edge=False)
    made.add_column("if this fails", overflow="fold")
    for title in counted:
        made.add_column(title, justify="right")
    made.add_column("what fails with it")
    for part, counts, lost in rows:
        made.add_row(part, *counts, lost)
    return made


def _stacked(part: Text, counts: Sequence[str], lost: str, titles: Sequence[str]) -> Text:
    numbers = ", ".join(f"{title} {count}" for title, count in zip(titles, counts, strict=True))
    return Text.assemble(part, f"  {numbers}\n    {lost}")


def _is_alone(group: Sequence[Impact]) -> bool:
    return len(group) <= FEW and not group[0].harmless


def _pattern(one: Impact) -> tuple[object, ...]:
    """Equal for parts that differ only in the numbers of names, and for all that affect nothing else."""
    if one.harmless:
        return one.kind, *_counts(one, True)
    name, lost = (NUMBER.sub("#", text) for text in (one.name, losses(one)))
    return one.kind, one.single_point, name, lost, *_counts(one, True)


def _counts(one: Impact, programs: bool) -> list[str]:
    """How many robots and programs are lost; a program counts itself, as a robot does."""
    robots = _count(one.robots, one.missed)
    own = (one.name,) if one.kind == _PROGRAM else ()
    missed = tuple(name for name in own if name not in one.optional)
    ended = _count((*own, *one.programs), (*missed, *one.missed_programs))
    return [robots, ended] if programs else [robots]


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
    ranges = hostlist.ranges_of(names)
    more = sum(count for _, count in ranges[_NAMED:])
    shown = ", ".join(text for text, _ in ranges[:_NAMED])
    return f"{shown}{f' and {more} more' if more else ''} {one if len(names) == 1 else several}"


def _count(lost: Sequence[str], missed: Sequence[str]) -> str:
    spared = len(lost) - len(missed)
    return f"{len(missed)}{f' + {spared} optional' if spared else ''}"
