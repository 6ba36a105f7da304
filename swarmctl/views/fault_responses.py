"""What status showed of faults, as a table."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from swarmctl.health.fault_response import Response


def table(responses: Sequence[Response]) -> Table:
    """One row per fault; below the first line of status stands what was expected instead."""
    shown = Table(box=None, pad_edge=False, header_style="bold")
    shown.add_column("FAULT", overflow="fold", min_width=12)
    shown.add_column("FIRST LINE OF STATUS", overflow="fold", min_width=20)
    shown.add_column("DETECTED s", justify="right", no_wrap=True)
    shown.add_column("RECOVERED s", justify="right", no_wrap=True)
    for one in responses:
        glyph = ("✓ ", "green") if one.as_expected else ("✗ ", "red")
        line = Text(one.first)
        if one.detected is None or one.detected > one.within:
            line.append(f"\nexpected within {one.within:g} s: {one.expected}", "red")
        shown.add_row(Text.assemble(glyph, one.name), line, _seconds(one.detected), _seconds(one.recovered))
    return shown


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"
