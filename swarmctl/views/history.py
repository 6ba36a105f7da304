"""The runs that changed a swarm as text, the newest first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, timezone

from rich.text import Text

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
