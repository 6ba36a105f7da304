"""Progress of a rollout: one line per host on a terminal, one line per event elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text
from swarm_onboard.agent.steps import Kind

from swarmctl.deploy.outcome import Outcome, Removed, Result
from swarmctl.deploy.prepare import Prepared
from swarmctl.plan.plan import HostPlan
from swarmctl.remote.parallel_hosts import (
    Event,
    Finished,
    Note,
    Started,
)
from swarmctl.remote.transport import HostError
from swarmctl.views.escape import printable

Shown = Event[Outcome] | Event[Removed] | Event[Prepared]
MOST_NAMED = 2  # units; more are counted
MOST_STEPS = 5  # of a preparation; more are counted
MOST_SHOWN = 12  # hosts with a line each during a run
_FREE = 3  # columns at the end of a line, and lines of the screen: "^C" echoed there moves no line


def line(event: Shown) -> Text | None:
    """One event as one line; None for events that are not shown. What was done stands in the report."""
    match event:
        case Started(host):
            return Text(f"{host}: connecting")
        case Note(host, text):
            return Text(f"{host}: {printable(text)}")
        case Finished(host, outcome, seconds):
            return Text.assemble(f"{host}: ", _ending(outcome), f"  ({seconds:.1f} s)" if seconds else "")
    return None


def _ending(result: Result) -> Text:
    if isinstance(result, HostError):
        return Text.assemble((f"{result.kind.value}", "bold red"), f": {printable(result.message)}")
    if not result.changed:
        return Text("nothing to do", "green")
    words = {Removed: "removed", Prepared: "prepared", Outcome: "deployed"}
    return Text(words[type(result)], "bold green")


def verdict(result: Result, *, details: bool = False) -> Text:
    """The result of a host in a few words; with ``details``, all units and steps by name."""
    text = _ending(result)
    if isinstance(result, HostError | Removed) or not result.changed:
        return text
    if isinstance(result, Prepared):
        done = [f"{step.kind.value} {step.target}" for step in result.steps]
        return text.append(f": {printable(_named(done, 'steps', len(done) if details else MOST_STEPS))}")
    return text.append(f" {result.plan.next}{_done(result.plan, details)}")


def _done(plan: HostPlan, details: bool) -> str:
    words = {
        Kind.START: "started",
        Kind.RESTART: "restarted",
        Kind.RELOAD_UNIT: "reloaded",
        Kind.STOP: "stopped",
    }
    units = {word: plan.targets(kind) for kind, word in words.items() if plan.targets(kind)}
    most = len(plan.steps) if details else MOST_NAMED
    done = "; ".join(f"{word} {_named(names, 'units', most)}" for word, names in units.items())
    return f", {done}" if done else ""


def _named(names: Sequence[str], what: str, most: int) -> str:
    return ", ".join(names) if len(names) <= most else f"{len(names)} {what}"


@dataclass
class Board:
    """The state of every host, redrawn for each event; of many, those at work and those that failed.

    Each host has one line, cut where the terminal ends; hosts for which the screen is too low are counted.
    """

    hosts: Sequence[str]
    _lines: dict[str, Text] = field(default_factory=dict)
    _well: set[str] = field(default_factory=set)  # finished without an error

    def take(self, event: Shown) -> None:
        """Show the event in the line of its host."""
        shown = line(event)
        if shown is not None:
            self._lines[event.host] = shown[len(event.host) + 2 :]
        if isinstance(event, Finished) and not isinstance(event.outcome, HostError):
            self._well.add(event.host)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        free = max(console.height - _FREE, 2)
        hosts, rows = list(self.hosts), []
        if len(hosts) > min(MOST_SHOWN, free):
            rows.append(("", Text(f"{len(self._well)} of {len(hosts)} hosts done", "bold")))
            hosts = [host for host in hosts if host in self._lines and host not in self._well]
        most = free - len(rows)
        shown = hosts if len(hosts) <= most else hosts[: most - 1]
        rows += [(host, self._lines.get(host, Text("waiting", "dim"))) for host in shown]
        if len(hosts) > len(shown):
            rows.append(("", Text(f"... and {len(hosts) - len(shown)} more", "dim")))
        width = max((cell_len(host) for host, _ in rows), default=0)
        for host, text in rows:
            name = (f"{host}{' ' * (width - cell_len(host))}  ", "bold") if host else ""
            row = Text.assemble(name, text)
            row.truncate(max(options.max_width - _FREE, 1), overflow="ellipsis")
            yield row
