"""A plan as text: the summary, then the steps of each host or of equal hosts, with their causes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from rich.cells import cell_len
from rich.text import Text
from swarm_onboard.agent.steps import Kind

from swarmctl.plan.plan import HostPlan, Plan, Problem
from swarmctl.plan.waves import Order
from swarmctl.views.equal_hosts import FEW, Names, grouped, merged_behind, notes
from swarmctl.views.escape import printable
from swarmctl.views.graph.analyses import losses
from swarmctl.views.width import shortened, wrapped
from swarmctl.yamltext import hostlist

_TOGETHER = {
    "wave": "the hosts of a wave stay changed or go back together",
    "all": "all stay changed or go back together",
}


def order_text(order: Order, width: int | None = None) -> Text:
    """Returns which hosts change one after the other, and what becomes of them if one fails."""
    waves = ", then ".join(hostlist.written(wave) for wave in order.waves)
    rule = _TOGETHER.get(order.consistency)
    return wrapped(Text(f"order: {waves}{f'; {rule}' if rule else ''}"), width, 2)


_GLYPH = {
    Kind.SECRET: ("*", "cyan"),
    Kind.KEY: ("*", "cyan"),
    Kind.CREATE: ("+", "green"),
    Kind.UPDATE: ("~", "yellow"),
    Kind.DELETE: ("-", "red"),
    Kind.STOP: ("■", "red"),
    Kind.ACTIVATE: ("»", "cyan"),
    Kind.LINK: ("+", "green"),
    Kind.UNLINK: ("-", "red"),
    Kind.BLOCK: ("~", "yellow"),
    Kind.RELOAD: ("↻", "cyan"),
    Kind.RELOAD_UNIT: ("↻", "cyan"),
    Kind.RESTART: ("↻", "yellow"),
    Kind.START: ("▶", "green"),
}
_FILES = (Kind.CREATE, Kind.UPDATE, Kind.DELETE)
_UNITS = (Kind.STOP, Kind.RELOAD_UNIT, Kind.RESTART, Kind.START)
_COUNTED = {**dict.fromkeys(_FILES, "file"), Kind.LINK: "link", Kind.UNLINK: "link"}
_MOST_LISTED = 4  # files or links of one kind; more are counted
_TARGET = 16  # the column of a step's target
_NARROWEST = 20  # columns for causes beside their targets; in fewer they stand below


@dataclass(frozen=True)
class PlanView:
    """How a plan is shown: the ``names`` that hosts may differ in, all ``details`` or not, columns."""

    names: Mapping[str, Names] = field(default_factory=dict)
    diff: bool = False
    details: bool = False
    width: int | None = None
    complete: Callable[[str], str] = str  # writes the commands in hints as they can be typed

    def text(self, shown: Plan) -> Text:
        """The summary, then the hosts, then the worst single points of failure."""
        text = self._line(summary(shown))
        changed = [host for host in shown.hosts if host.steps or host.problem]
        for hosts in self._equal(changed):
            text.append("\n").append_text(self._hosts(hosts))
        noted = [(host.host, note) for host in shown.hosts for note in host.notes]
        shown_notes = notes(noted, self.names, details=self.details, width=self.width, complete=self.complete)
        text.append("\n" if noted else "").append_text(shown_notes)
        idle = [host.host for host in shown.hosts if not host.steps and not host.problem]
        if idle and len(idle) < len(shown.hosts):
            text.append_text(self._line(Text(f"\nup to date: {hostlist.written(idle)}")))
        text.append_text(self._single_points(shown))
        text.rstrip()
        return text

    def _equal(self, hosts: Sequence[HostPlan]) -> list[list[HostPlan]]:
        """Hosts of the same difference together if they are more than a few, and all of the same problem."""
        return grouped(
            hosts,
            self._pattern,
            alone=lambda group: self.details or (len(group) <= FEW and not group[0].problem),
        )

    def _pattern(self, host: HostPlan) -> tuple[object, ...]:
        own = self._own(host)
        problem = host.problem
        shown = (
            [problem.message, problem.hint]
            if problem
            else [f"{step.target} {step.cause}" for step in host.steps]
        )
        kinds = (problem.kind,) if problem else tuple(step.kind for step in host.steps)
        texts = [*shown, *(host.diffs.values() if not problem else ())]
        return own.kind if not problem else "", kinds, own.pattern_of("\n".join(map(printable, texts)))

    def _own(self, host: HostPlan) -> Names:
        return self.names.get(host.host) or Names(host.host)

    def _line(self, line: Text, indent: int = 4) -> Text:
        return wrapped(line, self.width, indent).append("\n")

    def _hosts(self, hosts: Sequence[HostPlan]) -> Text:
        first = hosts[0]
        if first.problem:
            return self._problem(hosts, [host.problem for host in hosts if host.problem])
        listed = hostlist.written(host.host for host in hosts)
        like = f"{len(hosts)} hosts like {first.host}: " if len(hosts) > 1 else ""
        release = "" if like else f"{first.previous or 'nothing'} -> {first.next}: "
        text = self._line(Text.assemble((listed, "bold"), f"  {like}{release}{_counted(first)}"))
        steps = list(_steps(first, self.details))
        target = max((cell_len(name) for _, name, _ in steps), default=0)
        for kind, name, cause in steps:
            text.append_text(self._step(kind, name, cause, target))
        for body in first.diffs.values() if self.diff else ():
            text.append_text(self._diff(body))
        return text

    def _problem(self, hosts: Sequence[HostPlan], problems: Sequence[Problem]) -> Text:
        own = [self._own(host) for host in hosts]
        message = merged_behind([printable(one.message) for one in problems], own)
        listed = hostlist.written(host.host for host in hosts)
        kind = (f"  {problems[0].kind}: ", "bold red")
        text = self._line(Text.assemble((listed, "bold"), kind, message))
        hint = self.complete(printable(problems[0].hint))
        return text.append_text(self._line(Text(f"  help: {hint}", "green"), 8)) if hint else text

    def _step(self, kind: str, name: str, cause: str, target: int) -> Text:
        glyph, style = _GLYPH[kind]
        start = Text.assemble("  ", (f"{glyph} {kind:<11}", style), " ")
        beside = _TARGET + target + 2
        least = max((min(_NARROWEST, cell_len(cause)), *map(cell_len, cause.split())))
        if self.width is None or beside + least <= self.width:
            return self._line(start.append(f"{name:<{target}}").append(f"  {cause}", "dim"), beside)
        text = self._line(start.append(shortened(name, self.width - _TARGET)))
        return text.append_text(self._line(Text(f"{' ' * 6}{cause}", "dim"), 6)) if cause else text

    def _diff(self, body: str) -> Text:
        text = Text()
        for line in body.splitlines():
            style = {"+": "green", "-": "red", "@": "cyan"}.get(line[:1], "")
            text.append_text(self._line(Text(f"    {printable(line)}", style), 6))
        return text

    def _single_points(self, shown: Plan) -> Text:
        """The worst single points of failure; `swarmctl graph --impact` lists all."""
        if not shown.single_points:
            return Text()
        text = Text("\n").append("single points of failure\n", "bold")
        width = max(len(f"{one.kind} {one.name}") for one in shown.single_points)
        for one in shown.single_points:
            line = Text(f"  ! {f'{one.kind} {one.name}':<{width}}", "yellow").append(
                f"  {losses(one)}", "dim"
            )
            text.append_text(self._line(line, 6))
        return text


def _steps(host: HostPlan, details: bool) -> Iterator[tuple[str, str, str]]:
    """Kind, target and cause of each step. Without ``details``, many files or links are one of a count, and
    units that follow each other for one cause are ranges."""
    counted = {kind for kind in _COUNTED if len(host.targets(kind)) > _MOST_LISTED and not details}
    for (kind, cause), steps in groupby(host.steps, lambda one: (one.kind, one.cause)):
        targets = [one.target for one in steps]
        if kind in counted:
            if host.targets(kind)[0] in targets:
                yield _counted_step(host, kind)
            continue
        if kind in _UNITS and not details:
            targets = [names for names, _ in hostlist.ranges_of(targets)]
        yield from ((kind, printable(target), printable(cause)) for target in targets)


def _counted_step(host: HostPlan, kind: str) -> tuple[str, str, str]:
    causes = list(dict.fromkeys(one.cause for one in host.steps if one.kind == kind))
    many = _many(len(host.targets(kind)), _COUNTED[kind])
    return kind, many, printable(causes[0]) if len(causes) == 1 else "--details lists them"


def _counted(host: HostPlan) -> str:
    files, units = len(host.targets(*_FILES)), len(host.targets(*_UNITS))
    return ", ".join(filter(None, [_many(files, "file"), _many(units, "unit")])) or "small repairs"


def summary(shown: Plan) -> Text:
    """``plan: 12 files, 3 restarts on 2 hosts``, or ``nothing to do``."""
    stuck = hostlist.written(host.host for host in shown.problems)
    tail = f"cannot be deployed: {stuck}" if stuck else ""
    if len(shown.problems) == len(shown.hosts):
        return Text(tail)
    if not shown.changes:
        return Text(f"nothing to do; {tail}" if tail else "nothing to do")
    counts = shown.counts
    files = sum(counts[kind] for kind in _FILES)
    hosts = sum(bool(host.steps) and not host.problem for host in shown.hosts)
    parts = [
        _many(files, "file"), _many(counts[Kind.START], "start"),
        _many(counts[Kind.RESTART], "restart"), _many(counts[Kind.RELOAD_UNIT], "reload"),
        _many(counts[Kind.STOP], "stop"),
    ]  # fmt: skip
    counted = ", ".join(part for part in parts if part) or "small repairs"
    return Text(f"plan: {counted} on {_many(hosts, 'host')}{'; ' + tail if tail else ''}")


def _many(count: int, word: str) -> str:
    return f"{count} {word}{'s' if count > 1 else ''}" if count else ""
