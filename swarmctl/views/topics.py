"""The topics of islands as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.table import Table

from swarmctl.render.topic_tool import Listed
from swarmctl.views.equal_hosts import grouped
from swarmctl.views.escape import printable
from swarmctl.yamltext import hostlist


def table(found: Mapping[str, Sequence[Listed]]) -> Table:
    """One row per topic; islands where its type and its counts are equal share it."""
    shown = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("TOPIC", "TYPE", "PUBLISHERS", "SUBSCRIBERS", *(("ISLANDS",) if len(found) > 1 else ())):
        shown.add_column(title, overflow="fold")
    rows = [(one, island) for island, topics in found.items() for one in topics]
    for group in grouped(sorted(rows, key=lambda row: row[0].topic), lambda row: row[0]):
        one = group[0][0]
        islands = (hostlist.written(island for _, island in group),) if len(found) > 1 else ()
        counts = (str(one.publishers), str(one.subscribers))
        shown.add_row(printable(one.topic), printable(one.type), *counts, *islands)
    return shown
