"""What a trial needs, as a table."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from swarmctl.health.readiness import Item
from swarmctl.views.escape import printable


def table(found: Sequence[Item]) -> Table:
    """Returns a row for each item, and the verdict on all of them."""
    shown = Table(box=None, pad_edge=False, show_header=False)
    for _ in range(3):
        shown.add_column(overflow="fold")
    for one in found:
        shown.add_row(one.what, _verdict(one.go), Text(printable(one.text)))
    shown.add_row(Text("all", "bold"), _verdict(all(one.go for one in found)), "")
    return shown


def _verdict(go: bool) -> Text:
    return Text("go", "green") if go else Text("NO-GO", "bold red")
