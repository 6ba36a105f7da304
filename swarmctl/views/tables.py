"""Tables of topics, of what units cost, and of answers to faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.console import Group
from rich.table import Table
from rich.text import Text

from swarmctl.health.fault_response import Response
from swarmctl.health.host_costs import UnitCost
from swarmctl.remote.transport import HostError
from swarmctl.render.topic_tool import Listed
from swarmctl.views.equal_hosts import grouped
from swarmctl.views.escape import printable
from swarmctl.yamltext import hostlist


def topic_table(found: Mapping[str, Sequence[Listed]]) -> Table:
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


def cost_table(units: Sequence[UnitCost], errors: Mapping[str, HostError]) -> Group:
    """CPU in percent of one core, memory in MB; hosts that do not answer stand below."""
    found = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for title in ("host", "unit"):
        found.add_column(title)
    for title in ("CPU %", "memory MB", "processes"):
        found.add_column(title, justify="right")
    before = ""
    for one in units:
        host, before = one.host if one.host != before else "", one.host
        found.add_row(
            host, printable(one.name), f"{100 * one.cpu:.1f}", f"{one.memory / 1e6:.0f}", str(one.processes)
        )
    lines = (f"{host}  {error.kind.value}: {printable(str(error))}" for host, error in errors.items())
    return Group(found, *map(Text, lines))


def response_table(responses: Sequence[Response]) -> Table:
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
