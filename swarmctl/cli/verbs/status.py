"""``swarmctl status``: shows whether the swarm is healthy, and the causes if it is not."""

from __future__ import annotations

import json as json_format
import time
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from swarmctl.cli import console, executors, exit_codes, forgotten_lab, next_command, options, selected
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    from rich.text import Text

    from swarmctl.health.swarm_health import Status
    from swarmctl.remote.transport import Transport

Look = Callable[[], "Status"]
WINDOW = 2.0  # s in which rates are measured
_AGAIN = 1.0  # s between two looks of --wait


class Goal(str, Enum):
    """What ``--wait`` waits for."""

    HEALTHY = "healthy"
    REACHABLE = "reachable"

    def reached(self, seen: Status) -> bool:
        """Returns True if the swarm is so: healthy, or all its hosts answer that are not optional."""
        if self is Goal.HEALTHY:
            return seen.diagnosis.healthy
        return not any(one.check == "host" for one in seen.diagnosis.troubles)


def status(
    spec: options.Spec,
    overlays: options.Overlays = None,
    watch: Annotated[bool, typer.Option("--watch", help="Repeat until Ctrl-C.")] = False,
    every: Annotated[float, typer.Option(min=1.0, metavar="SECONDS", help="Interval of --watch.")] = 5.0,
    wait: Annotated[
        bool, typer.Option("--wait", help="Repeat until the swarm is as --for says, at most for --timeout.")
    ] = False,
    goal: Annotated[
        Goal, typer.Option("--for", help="With --wait: healthy, or all hosts answer.")
    ] = Goal.HEALTHY,
    timeout: Annotated[
        float, typer.Option(min=1.0, metavar="SECONDS", help="How long --wait waits at most.")
    ] = 120.0,
    window: Annotated[
        float,
        typer.Option(
            min=0.5, max=10.0, metavar="SECONDS", help="How long the rate of each topic is measured."
        ),
    ] = WINDOW,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = options.PARALLEL,
    executor: executors.Executor = "",
    details: options.Details = False,
    json: options.Json = False,
    junit: Annotated[
        Path | None,
        typer.Option("--junit", metavar="FILE", help="Also write the findings to FILE as JUnit XML, for CI."),
    ] = None,
) -> None:
    """Show the health of hosts, robots and programs. Exit code 4 if the only cause is unreachable hosts."""
    if watch and (wait or junit is not None):
        usage = f"--watch and {'--wait' if wait else '--junit'} exclude each other"
        console.fail(usage, "--watch repeats until Ctrl-C", code=exit_codes.USAGE)
    where = next_command.where(lab=lab, lab_name=lab_name, limit=limit, executor=executor)
    complete = next_command.completing(spec, where)
    with executors.transport(executor, in_lab=options.in_lab(lab, lab_name)) as transport:
        look = look_of(spec, limit, transport, lab=lab, lab_name=lab_name, window=window, parallel=parallel)
        if watch and json:
            _each_round(look, every, lambda seen: print(json_format.dumps(seen.to_json()), flush=True))
        elif watch:
            _watch(look, every, details=details, complete=complete)
        seen = _awaited(look, goal, timeout) if wait else _observed(look)
    if json:
        console.print_json(seen.to_json())
    else:
        from swarmctl.views import status as view

        console.out().print(view.status(seen, details=details, width=console.columns(), complete=complete))
        if not options.in_lab(lab, lab_name):
            kinds = ["unreachable" if one.check == "host" else one.check for one in seen.diagnosis.troubles]
            forgotten_lab.guess("status", spec, seen.swarm, kinds, limit)
        _advise(seen, spec, where, in_lab=options.in_lab(lab, lab_name))
    if junit is not None:
        from swarmctl.cli import file_writes
        from swarmctl.views import status_junit

        file_writes.replace(junit, status_junit.render(seen).encode())
    raise typer.Exit(exit_codes.OK if wait and goal.reached(seen) else _exit(seen))


def look_of(
    spec: SpecFiles,
    limit: list[str] | None,
    transport: Transport,
    *,
    lab: bool,
    lab_name: str,
    window: float = WINDOW,
    parallel: int = options.PARALLEL,
) -> Look:
    """A function that observes all hosts and diagnoses the swarm."""
    from swarmctl.health import swarm_health as health
    from swarmctl.health.collect import probe_hosts
    from swarmctl.health.diagnosis import diagnose
    from swarmctl.health.expected_graph import Release, expected_graph
    from swarmctl.linter.launch_uses import launch_uses, nodes_of
    from swarmctl.render.build_bundle import bundles
    from swarmctl.swarm.index import SwarmIndex

    document = console.read_document(spec)
    swarm = console.swarm_of(document, options.lab_of(document, lab, lab_name))
    wanted = bundles(swarm)
    releases = {
        name: Release(wanted[name].digest, tuple(unit.name for unit in wanted[name].units))
        for name in selected.hosts(swarm.candidates, limit)
        if wanted[name].files
    }
    graph = expected_graph(swarm, releases)
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    launched = nodes_of(launch_uses(SwarmIndex(document)))

    def look() -> Status:
        outcomes = probe_hosts(graph, targets, transport, window=window, parallel=parallel)
        return health.status(graph, outcomes, diagnose(graph, outcomes, launched))

    return look


def _advise(seen: Status, spec: SpecFiles, where: list[str], *, in_lab: bool) -> None:
    """What comes after a status: keys to pin, the deploy of a missing or old release, or another look."""
    if any(one.check == "host-key" for one in seen.diagnosis.troubles) and not in_lab:
        next_command.advise("trust", spec, *where)
    elif any(cause.check == "release" for cause, _ in seen.diagnosis.explained()):
        next_command.advise("plan", spec, *where)
    elif not seen.diagnosis.healthy:
        next_command.advise("status", spec, *where, "--watch")


def _observed(look: Look) -> Status:
    """Observe the hosts, with a progress message on a terminal."""
    if not console.err().is_terminal:
        return look()
    with console.err().status("connecting to the hosts ..."):
        return look()


def _awaited(look: Look, goal: Goal, timeout: float) -> Status:
    """Observes until the goal is reached or the time is up; prints what it waits for when that changes."""
    from swarmctl.views.escape import printable

    due, last = time.monotonic() + timeout, ""
    while True:
        seen = look()
        if goal.reached(seen):
            return seen
        if time.monotonic() >= due:
            console.err().print(f"not {goal.value} within {timeout:g} s", highlight=False)
            return seen
        first, count = seen.diagnosis.troubles[0], len(seen.diagnosis.troubles)
        more = f", and {count - 1} more" if count > 1 else ""
        text = f"waiting: {printable(first.key)}: {printable(first.message)}{more}"
        if text != last:
            console.err().print(text, highlight=False, markup=False, soft_wrap=True)
            last = text
        time.sleep(min(_AGAIN, max(0.0, due - time.monotonic())))


def _watch(look: Look, every: float, *, details: bool, complete: Callable[[str], str]) -> NoReturn:
    """Print each round: in place on a terminal, elsewhere one block after the other."""
    from swarmctl.views import status as view

    def text(seen: Status) -> Text:
        return view.status(seen, details=details, width=console.columns(), complete=complete)

    if not console.out().is_terminal:
        _each_round(look, every, lambda seen: console.out().print(text(seen), end="\n\n"))
    from rich.live import Live

    with Live(console=console.out(), auto_refresh=False) as live:
        _each_round(look, every, lambda seen: live.update(text(seen), refresh=True))


def _each_round(look: Look, every: float, show: Callable[[Status], None]) -> NoReturn:
    """Repeat for ever: observe, show, wait for the rest of ``every`` seconds."""
    while True:
        due = time.monotonic() + every
        show(look())
        time.sleep(max(0.0, due - time.monotonic()))


def _exit(seen: Status) -> int:
    if seen.diagnosis.healthy:
        return exit_codes.OK
    return exit_codes.HOSTS_UNREACHABLE if seen.diagnosis.only_unreachable else exit_codes.UNHEALTHY
