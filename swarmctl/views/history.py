"""The runs that changed a swarm as text, the newest first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime, timezone

from rich.console import Group
from rich.table import Table
from rich.text import Text

from swarmctl.plan.command_history import Event, Record, Span, Start
from swarmctl.plan.history import APPLIED, FORGOTTEN, Run
from swarmctl.remote import operators
from swarmctl.remote.transport import HostError
from swarmctl.views.escape import printable
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist

_SHOWN = 8  # digits of the names of runs


def history_text(runs: Sequence[Run], errors: Mapping[str, HostError], width: int | None) -> Text:
    """Returns a line for each run, one below for each of its results, and the hosts that did not answer."""
    text = Text()
    for run in reversed(runs):
        when = datetime.fromtimestamp(run.time, tz=timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
        who = printable(operators.person(run.who)) or "someone"
        head = Text.assemble((run.name[:_SHOWN], "bold"), f"  {when}  {who}")
        text.append_text(wrapped(head, width, 2)).append("\n")
        for result, hosts in results(run).items():
            text.append_text(wrapped(Text(f"  {hostlist.written(hosts)}  {result}"), width, 4)).append("\n")
    if not runs and not errors:
        text.append("no host was changed yet\n")
    for host, error in errors.items():
        text.append_text(wrapped(Text(f"{host}  {error.kind.value}: {printable(str(error))}"), width, 2))
        text.append("\n")
    text.right_crop(1)
    return text


def results(run: Run) -> Mapping[str, list[str]]:
    """Returns what a run did, each with the hosts where it did that."""
    found: dict[str, list[str]] = {}
    for host, one in run.changes.items():
        if one.state == FORGOTTEN:
            found.setdefault(f"forgot {printable(one.error)}", []).append(host)
            continue
        way = f"{one.previous or 'nothing'} -> {one.next or 'nothing'}"
        way += ", other secrets" if one.previous_secrets != one.next_secrets and one.previous else ""
        undone = "" if one.state == APPLIED else f", undone: {printable(one.error)}"
        found.setdefault(way + undone, []).append(host)
    return found


_MINUTE, _HOUR = 60, 3600  # s


def command_table(
    events: Sequence[Event],
    runs: Sequence[Run],
    records: Mapping[tuple[str, str], Record],
    errors: Mapping[str, HostError],
) -> Group:
    """Returns the events and the runs that changed hosts; the state of each record stands below."""
    found = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for title in ("time", "robot", "commanded by", "for", "host"):
        found.add_column(title, overflow="fold")
    rows = [(event.what.time, _cells(event)) for event in events]
    rows += [(run.time, cells) for run in runs for cells in _changes(run)]
    for time, cells in sorted(rows, key=lambda row: row[0], reverse=True):
        found.add_row(_when(time), *cells)
    states = (line for key, record in records.items() for line in _state(*key, record))
    failed = (f"{host}  {error.kind.value}: {printable(str(error))}" for host, error in errors.items())
    return Group(found, *map(Text, states), *map(Text, failed))


def _cells(event: Event) -> tuple[str, str, str, str]:
    what, robot = event.what, printable(event.robot)
    if isinstance(what, Span):
        return robot, f"{printable(what.commander)} ({printable(what.node)})", _duration(what), event.host
    return robot, _start(what), "", event.host


def _start(what: Start) -> str:
    text = f"starts with release {printable(what.release)}"
    if what.changed:
        text += f"; may command: {printable(', '.join(what.commanders)) or 'nobody'}"
    return text + (f"; the record was torn: {what.cut} bytes were cut off" if what.cut else "")


def _duration(span: Span) -> str:
    if span.seconds is None:
        return "no end yet" if span.ongoing else "end not recorded"
    seconds = round(span.seconds)
    if seconds < _MINUTE:
        return f"{seconds} s"
    minutes, rest = divmod(seconds, _MINUTE)
    return f"{minutes} min {rest:02} s" if seconds < _HOUR else f"{minutes // 60} h {minutes % 60:02} min"


def _changes(run: Run) -> Iterator[tuple[str, str, str, str]]:
    who = printable(operators.person(run.who)) or "someone"
    for result, hosts in results(run).items():
        yield "", f"release {result}, by {who}", "", hostlist.written(hosts)


def _state(host: str, robot: str, record: Record) -> Iterator[str]:
    name = f"{printable(robot)} on {host}"
    if record.problem:
        yield f"{name}  the record proves nothing: {printable(record.problem)}"
    elif record.since is not None:
        yield f"{name}  recorded since {_when(record.since)}, {record.head.number} entries, unchanged"
    yield from (f"{name}  {printable(note)}" for note in record.notes)


def _when(time: float) -> str:
    return datetime.fromtimestamp(time, tz=timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
