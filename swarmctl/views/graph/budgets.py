"""Load and capacity of serial lines, adapters, boards, hosts and networks as tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.table import Table
from rich.text import Text

from swarmctl.analysis.bluetooth_load import STABLE, BluetoothBudget
from swarmctl.analysis.budgets import Budgets
from swarmctl.analysis.host_load import HostBudget
from swarmctl.analysis.network_load import IpLinkBudget, NetworkBudget
from swarmctl.analysis.radio_load import DongleBudget
from swarmctl.analysis.rosserial_load import RosserialBudget
from swarmctl.analysis.serial_load import SerialBudget
from swarmctl.views.equal_hosts import FEW, grouped
from swarmctl.yamltext import hostlist

_CAREFUL, _FULL = 0.7, 1.0

_Row = tuple[str | Text, ...]


def tables(shown: Budgets, *, details: bool = False) -> Iterator[Table]:
    """One table for each kind of budget that the swarm has.

    Rows that differ in nothing but their owner are one, unless with ``details``.
    """
    made = (
        (("line of", "kind", "bytes", "cycle of requests", "load"), map(_line, shown.lines)),
        (("adapter of", "name", "robots", "names", "load"), map(_adapter, shown.radios)),
        (("dongle of", "name", "exchanges", "robots", "load"), map(_dongle, shown.dongles)),
        (("link of", "kind", "traffic", "over", "load"), map(_ip_link, shown.ip_links)),
        (("board of", "kind", "publishers", "subscribers", "bytes", "load"), map(_board, shown.boards)),
        (("host", "kind", "memory", "for, MB", "used"), map(_host, shown.hosts)),
        (("network", "kind", "load", "traffic", "used"), map(_network, shown.networks)),
    )
    drawn = (_table(headings, rows, details=details) for headings, rows in made)
    return (table for table in drawn if table.row_count)


def _line(one: SerialBudget) -> _Row:
    load = one.load
    bytes_ = _of(load.needed, load.available, "B/s")
    kind, cycle = f"{load.kind}, {load.baud} baud", f"{load.cycle * 1000:.0f} ms"
    return one.robot, kind, bytes_, cycle, _share(load.share)


def _adapter(one: BluetoothBudget) -> _Row:
    robots = _of(len(one.members), STABLE)
    return one.host, one.adapter, robots, hostlist.written(one.members), _share(one.share)


def _dongle(one: DongleBudget) -> _Row:
    exchanges = f"{sum(one.exchanges):.0f}/s"
    return one.host, one.dongle, exchanges, hostlist.written(one.members), _share(one.share)


def _ip_link(one: IpLinkBudget) -> _Row:
    limit = f" of {one.capacity_mbps:g}" if one.capacity_mbps is not None else ""
    traffic = f"{one.needed_mbps:.3g}{limit} Mbit/s"
    return one.robot, one.kind, traffic, one.network or "-", "-" if one.share is None else _share(one.share)


def _board(one: RosserialBudget) -> _Row:
    publishers = _of(one.published, one.board.publishers)
    subscribers = _of(one.subscribed, one.board.subscribers)
    bytes_ = _of(one.needed, one.available, "B/s")
    return one.owner, one.name, publishers, subscribers, bytes_, _share(one.share)


def _host(one: HostBudget) -> _Row:
    parts = ", ".join(f"{what} {size}" for what, size in one.parts)
    return one.host, one.computer, _of(one.needed_mb, one.memory_mb, "MB"), parts, _share(one.share)


def _network(one: NetworkBudget) -> _Row:
    load = f"{one.needed_mbps:.3g} of {one.capacity_mbps:g} Mbit/s"
    return one.network, one.kind, load, _traffic(one), _share(one.share)


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
    for group in grouped(
        rows, lambda row: tuple(map(str, row[1:])), alone=lambda group: details or len(group) <= FEW
    ):
        made.add_row(hostlist.written(str(row[0]) for row in group), *group[0][1:])
    return made


def _share(share: float) -> Text:
    style = "bold red" if share > _FULL else "yellow" if share > _CAREFUL else "green"
    return Text(f"{share:.0%}" if share >= 0.01 else f"{share:.2%}", style)
