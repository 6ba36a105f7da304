"""Load and capacity of serial lines, adapters, boards, hosts and networks as tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.table import Table
from rich.text import Text

from swarmctl.analysis.bluetooth_load import STABLE
from swarmctl.analysis.budgets import Budgets
from swarmctl.analysis.network_load import NetworkBudget
from swarmctl.views.equal_hosts import FEW, grouped
from swarmctl.yamltext import hostlist

_CAREFUL, _FULL = 0.7, 1.0


_Row = tuple[str | Text, ...]
_Part = tuple[tuple[str, ...], Iterable[_Row]]  # headings and rows


def tables(shown: Budgets, *, details: bool = False) -> Iterator[Table]:
    """One table for each kind of budget that the swarm has.

    Rows that differ in nothing but their owner are one, unless with ``details``.
    """
    parts = (_lines, _radios, _dongles, _ip_links, _boards, _hosts, _networks)
    made = (_table(*part(shown), details=details) for part in parts)
    return (table for table in made if table.row_count)


def _lines(shown: Budgets) -> _Part:
    rows = (
        (
            one.robot,
            f"{one.load.kind}, {one.load.baud} baud",
            _of(one.load.needed, one.load.available, "B/s"),
            f"{one.load.cycle * 1000:.0f} ms",
            _share(one.load.share),
        )
        for one in shown.lines
    )
    return (("line of", "kind", "bytes", "cycle of requests", "load"), rows)


def _radios(shown: Budgets) -> _Part:
    rows = (
        (
            one.host,
            one.adapter,
            _of(len(one.members), STABLE),
            hostlist.written(one.members),
            _share(one.share),
        )
        for one in shown.radios
    )
    return (("adapter of", "name", "robots", "names", "load"), rows)


def _dongles(shown: Budgets) -> _Part:
    rows = (
        (
            one.host,
            one.dongle,
            f"{sum(one.exchanges):.0f}/s",
            hostlist.written(one.members),
            _share(one.share),
        )
        for one in shown.dongles
    )
    return (("dongle of", "name", "exchanges", "robots", "load"), rows)


def _ip_links(shown: Budgets) -> _Part:
    rows = (
        (
            one.robot,
            one.kind,
            f"{one.needed_mbps:.3g} of {one.capacity_mbps:g} Mbit/s"
            if one.capacity_mbps is not None
            else f"{one.needed_mbps:.3g} Mbit/s",
            one.network or "-",
            _share(one.share) if one.share is not None else "-",
        )
        for one in shown.ip_links
    )
    return (("link of", "kind", "traffic", "over", "load"), rows)


def _boards(shown: Budgets) -> _Part:
    rows = (
        (
            one.owner,
            one.name,
            _of(one.published, one.board.publishers),
            _of(one.subscribed, one.board.subscribers),
            _of(one.needed, one.available, "B/s"),
            _share(one.share),
        )
        for one in shown.boards
    )
    return (("board of", "kind", "publishers", "subscribers", "bytes", "load"), rows)


def _hosts(shown: Budgets) -> _Part:
    rows = (
        (
            one.host,
            one.computer,
            _of(one.needed_mb, one.memory_mb, "MB"),
            ", ".join(f"{what} {size}" for what, size in one.parts),
            _share(one.share),
        )
        for one in shown.hosts
    )
    return (("host", "kind", "memory", "for, MB", "used"), rows)


def _networks(shown: Budgets) -> _Part:
    rows = (
        (
            one.network,
            one.kind,
            f"{one.needed_mbps:.3g} of {one.capacity_mbps:g} Mbit/s",
            _traffic(one),
            _share(one.share),
        )
        for one in shown.networks
    )
    return (("network", "kind", "load", "traffic", "used"), rows)


def _traffic(budget: NetworkBudget) -> str:
    """How many topics and how many links of robots a network carries."""
    links = sum(not flow.topic.startswith("/") for flow in budget.flows)
    found = ((len(budget.flows) - links, "topic"), (links, "link"))
    shown = [f"{many} {what}{'' if many == 1 else 's'}" for many, what in found if many]
    return ", ".join(shown) or "0 topics"


def _of(used: float, there: float, unit: str = "") -> str:
    return f"{used:.0f} of {there:.0f} {unit}".rstrip()


def _table(headings: tuple[str, ...], rows: Iterable[_Row], *, details: bool) -> Table:
    made = Table(box=None, show_edge=False, pad_edge=False)
    for heading in headings:
        made.add_column(heading, overflow="fold")
    for group in grouped(rows, _beside, alone=lambda group: details or len(group) <= FEW):
        made.add_row(hostlist.written(str(row[0]) for row in group), *group[0][1:])
    return made


def _beside(row: _Row) -> tuple[str, ...]:
    """Everything but the owner."""
    return tuple(map(str, row[1:]))


def _share(share: float) -> Text:
    style = "bold red" if share > _FULL else "yellow" if share > _CAREFUL else "green"
    return Text(f"{share:.0%}" if share >= 0.01 else f"{share:.2%}", style)
