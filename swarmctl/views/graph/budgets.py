"""Load and capacity of serial lines, adapters, boards, hosts and networks as tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.table import Table
from rich.text import Text

from swarmctl.analysis.bluetooth_load import STABLE
from swarmctl.analysis.budgets import Budgets

_CAREFUL, _FULL = 0.7, 1.0


def tables(shown: Budgets) -> Iterator[Table]:
    """One table for each kind of budget that the swarm has."""
    made = (_lines(shown), _radios(shown), _boards(shown), _hosts(shown), _networks(shown))
    return (table for table in made if table.row_count)


def _lines(shown: Budgets) -> Table:
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
    return _table(("line of", "kind", "bytes", "cycle of requests", "load"), rows)


def _radios(shown: Budgets) -> Table:
    rows = (
        (one.host, one.adapter, _of(len(one.members), STABLE), ", ".join(one.members), _share(one.share))
        for one in shown.radios
    )
    return _table(("adapter of", "name", "robots", "names", "load"), rows)


def _boards(shown: Budgets) -> Table:
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
    return _table(("board of", "kind", "publishers", "subscribers", "bytes", "load"), rows)


def _hosts(shown: Budgets) -> Table:
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
    return _table(("host", "kind", "memory", "for, MB", "used"), rows)


def _networks(shown: Budgets) -> Table:
    rows = (
        (
            one.network,
            one.kind,
            f"{one.needed_mbps:.3g} of {one.capacity_mbps:g} Mbit/s",
            f"{len(one.flows)} topic{'' if len(one.flows) == 1 else 's'}",
            _share(one.share),
        )
        for one in shown.networks
    )
    return _table(("network", "kind", "load", "traffic", "used"), rows)


def _of(used: float, there: float, unit: str = "") -> str:
    return f"{used:.0f} of {there:.0f} {unit}".rstrip()


def _table(headings: tuple[str, ...], rows: Iterable[tuple[str | Text, ...]]) -> Table:
    made = Table(box=None, show_edge=False, pad_edge=False)
    for heading in headings:
        made.add_column(heading)
    for row in rows:
        made.add_row(*row)
    return made


def _share(share: float) -> Text:
    style = "bold red" if share > _FULL else "yellow" if share > _CAREFUL else "green"
    return Text(f"{share:.0%}" if share >= 0.01 else f"{share:.2%}", style)
