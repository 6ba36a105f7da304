"""``swarmctl logs``: what the swarm's units have logged, merged over its hosts in the order of time."""

from __future__ import annotations

import dataclasses
import json as json_format
import re
from datetime import datetime
from enum import Enum
from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, options, selected

_OFFSET = 0.1  # s from which a clock is worth a note


class Level(str, Enum):
    """The lowest level to print."""

    DEBUG = "debug"
    INFO = "info"
    WARN = "warn"
    ERROR = "error"
    FATAL = "fatal"


def logs(
    spec: options.Spec,
    overlays: options.Overlays = None,
    since: Annotated[
        str, typer.Option(metavar="TIME", help='Not before: 10m, 2h, 21:00, "2026-11-26 21:00".')
    ] = "",
    grep: Annotated[str, typer.Option(metavar="REGEX", help="Only messages that match.")] = "",
    level: Annotated[Level, typer.Option(help="Only messages of this level or worse.")] = Level.DEBUG,
    lines: Annotated[
        int, typer.Option("--lines", "-n", min=1, max=10000, metavar="N", help="The last N of each host.")
    ] = 200,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = options.PARALLEL,
    json: Annotated[
        bool, typer.Option("--json", callback=console.choose_json, help="Print one JSON object a line.")
    ] = False,
) -> None:
    """Show what drivers and programs have logged, of all hosts in the order of time."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.health import log_entries
    from swarmctl.health.host_logs import host_logs
    from swarmctl.remote.parallel_hosts import Finished, Skipped, result_of
    from swarmctl.remote.transport import HostError
    from swarmctl.views import logs as view

    try:
        start = log_entries.since(since, datetime.now().astimezone()) if since else 0.0
    except ValueError:
        console.fail(f"--since {since}: not a time", "such as 10m, 2h or 21:00", code=exit_codes.USAGE)
    try:
        pattern = re.compile(grep) if grep else None
    except re.error as error:
        console.fail(f"--grep {grep}: {error}", code=exit_codes.USAGE)
    swarm = console.read_spec(spec)
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    chosen = [targets[name] for name in selected.hosts(swarm.candidates, limit)]
    found, errors = [], []
    for event in host_logs(swarm.name, chosen, transport(), lines=lines, since=start, parallel=parallel):
        if not isinstance(event, Finished | Skipped):
            continue
        result = result_of(event)
        if isinstance(result, HostError):
            errors.append(result)
            console.show(f"{event.host}: {result}", error=True)
            continue
        found.append(result.entries)
        if abs(result.offset) >= _OFFSET:
            console.show(
                f"note: {event.host}: its clock is {result.offset:+.1f} s off; corrected", error=True
            )
        if result.cut and since:
            console.show(f"note: {event.host}: there is more, only the newest are shown", error=True)
    for entry in log_entries.merged(found, level.value, pattern):
        if json:
            print(json_format.dumps(dataclasses.asdict(entry)))
        else:
            console.show(view.line(entry))
    failed = any(error.reached for error in errors)
    unreached = exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK
    raise typer.Exit(exit_codes.HOSTS_FAILED if failed else unreached)
