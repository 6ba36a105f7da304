"""``swarmctl status``: shows whether the swarm is healthy, and the causes if it is not."""

from __future__ import annotations

import json as json_format
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from swarmctl.cli import console, exit_codes, extras, next_command, options, swarm_look
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from rich.text import Text

    from swarmctl.cli.swarm_look import Looking
    from swarmctl.health.swarm_health import Look, Status

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


@with_where("limit", "parallel", "executor", spec=options.SpecOrReport)
def status(
    where: Where,
    archive: options.Archive = None,
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
    window: options.Window = options.WINDOW,
    details: options.Details = False,
    json: options.Json = False,
    junit: Annotated[
        Path | None,
        typer.Option("--junit", metavar="FILE", help="Also write the findings to FILE as JUnit XML, for CI."),
    ] = None,
    metrics: Annotated[
        Path | None,
        typer.Option("--metrics", metavar="FILE", help="Also write metrics of Prometheus to FILE."),
    ] = None,
) -> None:
    """Show the health of hosts, robots and programs. Exit code 4 if the only cause is unreachable hosts."""
    if watch and (wait or junit is not None):
        usage = f"--watch and {'--wait' if wait else '--junit'} exclude each other"
        console.fail(usage, "--watch repeats until Ctrl-C", code=exit_codes.USAGE)
    if metrics is not None:
        extras.need("--metrics", "metrics")
    if archive is not None:
        if watch or wait or where.limit or where.executor or where.in_lab:
            usage = (
                "--from shows what is in the archive; it goes with --details, --json, --junit and --metrics"
            )
            console.fail(usage, code=exit_codes.USAGE)
        look = _archived(archive, json=json, details=details)
        _write(look, junit, metrics)
        raise typer.Exit(_exit(look.status))
    complete = where.complete
    with where.transport() as transport:
        looking = swarm_look.looking(where, transport, window)
        if watch:
            _watch(looking, every, json=json, details=details, complete=complete, metrics=metrics)
        look = _awaited(looking, goal, timeout) if wait else _observed(looking)
    seen = look.status
    _show(seen, complete, json=json, details=details)
    if not json:
        if where.in_lab:
            _show_stand_ins(where.lab_of(seen.swarm))
        else:
            kinds = ["unreachable" if one.check == "host" else one.check for one in seen.diagnosis.troubles]
            where.guess_lab("status", seen.swarm, kinds)
        _show_awaited(seen.swarm, lab=where.in_lab)
        _advise(seen, where)
    _write(look, junit, metrics)
    raise typer.Exit(exit_codes.OK if wait and goal.reached(seen) else _exit(seen))


def _show(seen: Status, complete: Callable[[str], str], *, json: bool, details: bool) -> None:
    if json:
        console.print_json(seen.to_json())
    else:
        from swarmctl.views import status as view

        console.out().print(view.status(seen, details=details, width=console.columns(), complete=complete))


def _show_stand_ins(lab: str) -> None:
    """Prints which robots of a lab move without the driver that the spec names."""
    from swarmctl.lab import lab as labs
    from swarmctl.lab.errors import LabError

    with suppress(LabError):  # it has just gone down
        for line in labs.stand_ins(lab):
            console.show(line)


def _show_awaited(swarm: str, *, lab: bool) -> None:
    """Prints which hosts a `deploy --when-seen` or a `watch` on this machine waits for, and why."""
    from swarmctl.deploy import journal
    from swarmctl.views.escape import printable

    for host, why in journal.awaited(journal.folder(swarm), lab=lab).items():
        console.show(f"{host} gets the release once it can: {printable(why)}")


def _archived(archive: Path, *, json: bool, details: bool) -> Look:
    """Shows the status in an archive, and on stderr when it was taken."""
    from swarmctl.health import report_archive

    try:
        report = report_archive.read(archive)
    except report_archive.ReportError as error:
        console.fail(str(error), "`swarmctl report` writes one")
    taken = datetime.fromtimestamp(report.look.began).astimezone()
    console.show(f"taken {taken:%Y-%m-%d %H:%M:%S %z}, within {report.look.took:.1f} s", error=True)
    complete = next_command.completing(SpecFiles(report.spec), report.where)
    _show(report.look.status, complete, json=json, details=details)
    return report.look


def _advise(seen: Status, where: Where) -> None:
    """What comes after a status: keys to pin, the deploy of a missing or old release, or another look."""
    if any(one.check == "host-key" for one in seen.diagnosis.troubles) and not where.in_lab:
        where.advise("trust")
    elif any(cause.check == "release" for cause, _ in seen.diagnosis.explained()):
        where.advise("plan")
    elif not seen.diagnosis.healthy:
        where.advise("status", "--watch")


def _observed(looking: Looking) -> Look:
    """Observe the hosts, with a progress message on a terminal."""
    if not console.err().is_terminal:
        return looking()
    with console.err().status("connecting to the hosts ..."):
        return looking()


def _awaited(looking: Looking, goal: Goal, timeout: float) -> Look:
    """Observes until the goal is reached or the time is up; prints what it waits for when that changes."""
    from swarmctl.views.escape import printable

    due, last = time.monotonic() + timeout, ""
    while True:
        look = looking()
        seen = look.status
        if goal.reached(seen):
            return look
        if time.monotonic() >= due:
            console.err().print(f"not {goal.value} within {timeout:g} s", highlight=False)
            return look
        first, count = seen.causes()[0][0], len(seen.diagnosis.troubles)
        more = f", and {count - 1} more" if count > 1 else ""
        text = f"waiting: {printable(first.key)}: {printable(first.message)}{more}"
        if text != last:
            console.err().print(text, highlight=False, markup=False, soft_wrap=True)
            last = text
        time.sleep(min(_AGAIN, max(0.0, due - time.monotonic())))


def _watch(
    looking: Looking,
    every: float,
    *,
    json: bool,
    details: bool,
    complete: Callable[[str], str],
    metrics: Path | None,
) -> NoReturn:
    """Print each round: in place on a terminal, elsewhere one block or line of JSON after the other."""
    from swarmctl.views import status as view

    def text(seen: Status) -> Text:
        return view.status(seen, details=details, width=console.columns(), complete=complete)

    def rounds(show: Callable[[Status], None]) -> NoReturn:
        with console.until_ctrl_c():
            while True:
                due = time.monotonic() + every
                look = looking()
                show(look.status)
                _write_metrics(look, metrics)
                time.sleep(max(0.0, due - time.monotonic()))

    if json:
        rounds(lambda seen: print(json_format.dumps(seen.to_json()), flush=True))
    if not console.out().is_terminal:
        rounds(lambda seen: console.out().print(text(seen), end="\n\n"))
    from rich.live import Live

    with Live(console=console.out(), auto_refresh=False) as live:
        rounds(lambda seen: live.update(text(seen), refresh=True))


def _write(look: Look, junit: Path | None, metrics: Path | None) -> None:
    if junit is not None:
        from swarmctl.cli import file_writes
        from swarmctl.views import status_junit

        file_writes.replace(junit, status_junit.render(look.status).encode())
    _write_metrics(look, metrics)


def _write_metrics(look: Look, file: Path | None) -> None:
    if file is not None:
        from swarmctl.cli import file_writes
        from swarmctl.views import status_metrics

        file_writes.replace(file, status_metrics.render(look))


def _exit(seen: Status) -> int:
    if seen.diagnosis.healthy:
        return exit_codes.OK
    return exit_codes.HOSTS_UNREACHABLE if seen.diagnosis.only_unreachable else exit_codes.UNHEALTHY
