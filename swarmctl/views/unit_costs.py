"""What units cost, as a table with a row each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.console import Group
from rich.table import Table
from rich.text import Text

from swarmctl.health.host_costs import UnitCost
from swarmctl.remote.transport import HostError
from swarmctl.views.escape import printable


def table(units: Sequence[UnitCost], errors: Mapping[str, HostError]) -> Group:
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
