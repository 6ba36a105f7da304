"""A plan as text: the steps of each host with their causes, and the diffs on request."""

from __future__ import annotations

from rich.text import Text

from swarmctl.plan.plan import HostPlan, Kind, Plan, Problem, Step
from swarmctl.views.escape import printable
from swarmctl.views.graph.impact import losses

_GLYPH = {
    Kind.SECRET: ("*", "cyan"),
    Kind.CREATE: ("+", "green"),
    Kind.UPDATE: ("~", "yellow"),
    Kind.DELETE: ("-", "red"),
    Kind.STOP: ("■", "red"),
    Kind.ACTIVATE: ("»", "cyan"),
    Kind.LINK: ("+", "green"),
    Kind.UNLINK: ("-", "red"),
    Kind.BLOCK: ("~", "yellow"),
    Kind.RELOAD: ("↻", "cyan"),
    Kind.RESTART: ("↻", "yellow"),
    Kind.START: ("▶", "green"),
}


def plan(shown: Plan, *, diff: bool = False) -> Text:
    """The whole plan; hosts without changes share one line."""
    text = Text()
    idle = [host.host for host in shown.hosts if not host.steps and not host.problem]
    for host in shown.hosts:
        if host.steps or host.problem:
            text.append_text(host_plan(host, diff=diff)).append("\n")
        for note in host.notes:
            text.append(f"note: {host.host}: {printable(note)}\n", "dim")
    if idle:
        text.append(f"up to date: {', '.join(idle)}\n")
    text.append_text(_single_points(shown))
    return text.append_text(summary(shown))


def _single_points(shown: Plan) -> Text:
    """The worst single points of failure; `swarmctl graph --impact` lists all."""
    if not shown.single_points:
        return Text()
    text = Text("single points of failure\n", "bold")
    width = max(len(f"{one.kind} {one.name}") for one in shown.single_points)
    for one in shown.single_points:
        text.append(f"  ! {f'{one.kind} {one.name}':<{width}}", "yellow")
        text.append(f"  {losses(one)}\n", "dim")
    return text


def host_plan(host: HostPlan, *, diff: bool = False) -> Text:
    """The steps of one host, or the problem that prevents its plan."""
    if host.problem:
        return _problem(host.host, host.problem)
    text = Text.assemble((host.host, "bold"), f"  {host.base or 'nothing'} -> {host.next}\n")
    width = max(len(printable(step.target)) for step in host.steps)
    for step in host.steps:
        text.append_text(_step(step, width))
    if diff:
        for body in host.diffs.values():
            text.append_text(_diff(body))
    return text


def _problem(host: str, problem: Problem) -> Text:
    text = Text.assemble(
        (host, "bold"), (f"  {problem.kind}: ", "bold red"), printable(problem.message), "\n"
    )
    return text.append(f"  help: {printable(problem.hint)}\n", "green") if problem.hint else text


def summary(shown: Plan) -> Text:
    """``plan: 12 files, 3 restarts on 2 hosts``, or ``nothing to do``."""
    stuck = ", ".join(host.host for host in shown.problems)
    tail = f"cannot be deployed: {stuck}" if stuck else ""
    if len(shown.problems) == len(shown.hosts):
        return Text(tail)
    if not shown.changes:
        return Text(f"nothing to do; {tail}" if tail else "nothing to do")
    counts = shown.counts
    files = sum(counts[kind] for kind in (Kind.CREATE, Kind.UPDATE, Kind.DELETE))
    hosts = sum(bool(host.steps) and not host.problem for host in shown.hosts)
    parts = [
        _many(files, "file"), _many(counts[Kind.START], "start"),
        _many(counts[Kind.RESTART], "restart"), _many(counts[Kind.STOP], "stop"),
    ]  # fmt: skip
    counted = ", ".join(part for part in parts if part) or "small repairs"
    return Text(f"plan: {counted} on {_many(hosts, 'host')}{'; ' + tail if tail else ''}")


def _many(count: int, word: str) -> str:
    return f"{count} {word}{'s' if count > 1 else ''}" if count else ""


def _step(step: Step, width: int) -> Text:
    glyph, style = _GLYPH[step.kind]
    line = Text.assemble(
        "  ", (f"{glyph} {step.kind.value:<11}", style), f" {printable(step.target):<{width}}"
    )
    return line.append(f"  {printable(step.cause)}\n", "dim")


def _diff(body: str) -> Text:
    text = Text()
    for line in body.splitlines():
        style = {"+": "green", "-": "red", "@": "cyan"}.get(line[:1], "")
        text.append(f"    {printable(line)}\n", style)
    return text
