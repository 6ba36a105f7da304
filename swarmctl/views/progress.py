"""Progress of a rollout: one line per host on a terminal, one line per event elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rich.table import Table
from rich.text import Text

from swarmctl.deploy.prepare import Prepared
from swarmctl.deploy.rollout import Outcome, Removed, Result
from swarmctl.plan.plan import HostPlan, Kind
from swarmctl.remote.parallel_hosts import (
    Event,
    Finished,
    Note,
    Skipped,
    Started,
    result_of,
)
from swarmctl.remote.transport import HostError
from swarmctl.views.escape import printable

Shown = Event[Outcome] | Event[Removed] | Event[Prepared]
MOST_NAMED = 5  # units; more are counted
MOST_SHOWN = 12  # hosts with a line each during a run


def line(event: Shown) -> Text | None:
    """One event as one line; None for events that are not shown."""
    match event:
        case Started(host):
            return Text(f"{host}: connecting")
        case Note(host, text):
            return Text(f"{host}: {printable(text)}")
        case Finished(host, _, seconds):
            return Text.assemble(f"{host}: ", verdict(result_of(event)), f"  ({seconds:.1f} s)")
        case Skipped(host):
            return Text.assemble(f"{host}: ", verdict(result_of(event)))
    return None


def verdict(result: Result) -> Text:
    """The result of a host in a few words."""
    if isinstance(result, HostError):
        return Text.assemble((f"{result.kind.value}", "bold red"), f": {printable(result.message)}")
    if not result.changed:
        return Text("nothing to do", "green")
    if isinstance(result, Removed):
        return Text("removed", "bold green")
    if isinstance(result, Prepared):
        done = _named([f"{step.kind.value} {step.target}" for step in result.steps], "steps")
        return Text.assemble(("prepared", "bold green"), f": {printable(done)}")
    return Text.assemble(("deployed", "bold green"), f" {result.plan.next}{_done(result.plan)}")


def _done(plan: HostPlan) -> str:
    words = {Kind.START: "started", Kind.RESTART: "restarted", Kind.STOP: "stopped"}
    done = [f"{word} {_named(plan.targets(kind))}" for kind, word in words.items() if plan.targets(kind)]
    return f", {'; '.join(done)}" if done else ""


def _named(names: Sequence[str], what: str = "units") -> str:
    return ", ".join(names) if len(names) <= MOST_NAMED else f"{len(names)} {what}"


@dataclass
class Board:
    """The state of every host, redrawn for each event; of many, those at work and those that failed."""

    hosts: Sequence[str]
    _lines: dict[str, Text] = field(default_factory=dict)
    _well: set[str] = field(default_factory=set)  # finished without an error

    def take(self, event: Shown) -> None:
        """Show the event in the line of its host."""
        shown = line(event)
        if shown is not None:
            self._lines[event.host] = shown[len(event.host) + 2 :]
        if isinstance(event, Finished) and not isinstance(result_of(event), HostError):
            self._well.add(event.host)

    def __rich__(self) -> Table:
        table = Table.grid(padding=(0, 2))
        hosts = self.hosts
        if len(hosts) > MOST_SHOWN:
            table.add_row(Text(f"{len(self._well)} of {len(hosts)}", "bold"), Text("hosts done", "dim"))
            hosts = [host for host in hosts if host in self._lines and host not in self._well]
        for host in hosts:
            table.add_row(Text(host, "bold"), self._lines.get(host, Text("waiting", "dim")))
        return table
