"""Analyses of a swarm as text: who may reach what, command paths, the impact of failures, budgets."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from rich.cells import cell_len
from rich.table import Table
from rich.text import Text

from swarmctl.analysis.budgets import Budgets
from swarmctl.analysis.command_paths import CommandPath, Hop
from swarmctl.analysis.host_load import HostBudget
from swarmctl.analysis.impact import Impact
from swarmctl.analysis.network_load import IpLinkBudget, NetworkBudget
from swarmctl.analysis.radio_load import STABLE, BluetoothBudget, DongleBudget
from swarmctl.analysis.rosserial_load import RosserialBudget
from swarmctl.analysis.serial_load import SerialBudget
from swarmctl.swarm.flow import Flow
from swarmctl.swarm.resolved import Swarm
from swarmctl.views.equal_hosts import FEW, grouped
from swarmctl.yamltext import hostlist

_ANYONE, _EACH_OTHER = "everybody", "each other"


def flow_heading(swarm: Swarm) -> Text:
    """Which islands drop everything else."""
    by_level: dict[str, list[str]] = {}
    for island in sorted(swarm.islands, key=lambda one: not one.filtered):
        level = swarm.security if swarm.overlay and island.filtered else island.security
        by_level.setdefault(level, []).append(island.name)
    if not any(island.filtered for island in swarm.islands):
        levels = ", ".join(by_level)
        return Text(f"security: {levels}. Everybody may reach everything; this is what the swarm needs:")
    return Text("security: " + "; ".join(f"{one} in {hostlist.written(by_level[one])}" for one in by_level))


def flow_table(flows: Sequence[Flow]) -> Table:
    """One row for each flow."""
    made = Table(box=None, show_edge=False, pad_edge=False)
    for title in ("from", "may reach", "on", "because"):
        made.add_column(title, overflow="fold")
    for flow in flows:
        hosts = _EACH_OTHER if flow.hosts == flow.sources else hostlist.written(flow.hosts)
        made.add_row(hostlist.written(flow.sources) or _ANYONE, flow.service.value, hosts, flow.cause)
    return made


NUMBER = re.compile(r"(?<=[\w\[/,-])\d+")  # of a name or a range; counts stand behind a blank
_PROGRAM = "program"
_WIDEST, _NARROWEST = 30, 40  # columns of a part, and of what fails beside it; in fewer it stands below
_NAMED = 4  # names and ranges of one list that are shown; the rest are counted


def impact_table(
    impacts: Sequence[Impact], *, details: bool = False, width: int | None = None
) -> Table | Text:
    """One row for each program, and for each other part whose failure affects something.

    Parts that differ only in numbers of names share a row, and so do programs that end alone, unless with
    ``details``. Where few columns are left for what fails, it stands below each part.
    """
    programs = any(one.programs or one.kind == _PROGRAM for one in impacts)
    counted = ("robots lost", "programs") if programs else ("robots lost",)
    shown = [one for one in impacts if one.kind == _PROGRAM or not one.harmless]
    rows = []
    for group in grouped(shown, _impact_pattern, alone=lambda group: details or _is_alone(group)):
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


def _impact_pattern(one: Impact) -> tuple[object, ...]:
    """Equal for parts that differ only in the numbers of names, and for all that affect nothing else."""
    if one.harmless:
        return one.kind, *_counts(one, True)
    name, lost = (NUMBER.sub("#", text) for text in (one.name, losses(one)))
    return one.kind, one.single_point, name, lost, *_counts(one, True)


def _counts(one: Impact, programs: bool) -> list[str]:
    """How many robots and programs are lost; a program counts itself, as a robot does."""
    robots = _count_of(one.robots, one.missed)
    own = (one.name,) if one.kind == _PROGRAM else ()
    missed = tuple(name for name in own if name not in one.optional)
    ended = _count_of((*own, *one.programs), (*missed, *one.missed_programs))
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


def _count_of(lost: Sequence[str], missed: Sequence[str]) -> str:
    spared = len(lost) - len(missed)
    return f"{len(missed)}{f' + {spared} optional' if spared else ''}"


_STYLE = {"network": "blue", "master": "dim", "bridge": "dim", "robot": "bold"}


def paths(found: Sequence[CommandPath], *, details: bool = False) -> Text:
    """One line per path, or the reason why there is none.

    Paths that differ only in numbers of names share a line below a summary, unless with ``details``.
    """
    if not found:
        return Text("`control` names no commander of a robot")
    groups = grouped(found, _path_pattern, alone=lambda group: details or len(group) <= FEW)
    lines = [_paths_together(group) for group in groups]
    if len(lines) < len(found):
        lines.insert(0, Text(f"{len(found)} paths, equal ones as one line (--details: each of them)"))
    return Text("\n").join(lines)


def _path_pattern(one: CommandPath) -> tuple[object, ...]:
    """Equal for paths that differ only in numbers of names."""
    hops = tuple((hop.kind, *(NUMBER.sub("#", text) for text in (hop.name, hop.detail))) for hop in one.hops)
    return one.by, NUMBER.sub("#", one.robot), NUMBER.sub("#", one.why), hops


def _paths_together(group: Sequence[CommandPath]) -> Text:
    """Equal paths as one, in which each hop has the names of all."""
    first = group[0]
    hops = tuple(
        Hop(
            same[0].kind,
            hostlist.written(hop.name for hop in same),
            hostlist.written(hop.detail for hop in same),
        )
        for same in zip(*(one.hops for one in group), strict=True)
    )
    return path(replace(first, robot=hostlist.written(one.robot for one in group), hops=hops))


def path(found: CommandPath) -> Text:
    """One path, or why there is none."""
    if found.why:
        return Text.assemble(f"{found.by} to {found.robot}: ", ("no path", "bold red"), f": {found.why}")
    line = Text()
    for number, hop in enumerate(found.hops):
        line.append(" -> " if number else "").append(_hop(hop), _STYLE.get(hop.kind, ""))
    return line


def _hop(hop: Hop) -> str:
    detail = f" ({hop.detail})" if hop.detail else ""
    return f"{hop.kind} {hop.name}{detail}"


_CAREFUL, _FULL = 0.7, 1.0

_Row = tuple[str | Text, ...]


def budget_tables(shown: Budgets, *, details: bool = False) -> Iterator[Table]:
    """One table for each kind of budget that the swarm has.

    Rows that differ in nothing but their owner are one, unless with ``details``.
    """
    made = (
        (("line of", "kind", "bytes", "cycle of requests", "load"), map(_serial_line, shown.lines)),
        (("adapter of", "name", "robots", "names", "load"), map(_adapter, shown.radios)),
        (("dongle of", "name", "exchanges", "robots", "load"), map(_dongle, shown.dongles)),
        (("link of", "kind", "traffic", "over", "load"), map(_ip_link, shown.ip_links)),
        (("board of", "kind", "publishers", "subscribers", "bytes", "load"), map(_board, shown.boards)),
        (("host", "kind", "memory", "for, MB", "used"), map(_host, shown.hosts)),
        (("network", "kind", "load", "traffic", "used"), map(_network, shown.networks)),
    )
    drawn = (_table(headings, rows, details=details) for headings, rows in made)
    return (table for table in drawn if table.row_count)


def _serial_line(one: SerialBudget) -> _Row:
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
