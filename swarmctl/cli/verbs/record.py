"""``swarmctl record``: topics recorded on the hosts that publish them, and the bags brought here."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, next_command, options, selected
from swarmctl.cli.where import Where, with_where


@with_where("limit", "parallel")
def record(
    where: Where,
    topics: Annotated[
        list[str] | None,
        typer.Argument(metavar="TOPIC", help="Only these: /k3/odom, '/k3/*', '*/scan'. Without any: all."),
    ] = None,
    duration: Annotated[
        float, typer.Option(min=0.0, metavar="SECONDS", show_default=False, help="End after this time.")
    ] = 0.0,
    size: Annotated[int, typer.Option(min=1, metavar="MB", help="Begin a new bag at this size.")] = 256,
    folder: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Bring the bags here instead of to NAME-bags."),
    ] = None,
    fetch: Annotated[
        bool, typer.Option("--fetch", help="Record nothing: end what records, and fetch what hosts have.")
    ] = False,
    json: options.Json = False,
) -> None:
    """Record topics in bags, on the hosts that publish them, until Ctrl-C; then fetch the bags.

    A recording goes on while its host is not connected, and ends before the disk is full.
    """
    from swarmctl.cli.recording_hosts import RecordingHosts
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.render.recording_requests import requests

    if fetch and (topics or duration):
        console.fail("--fetch records nothing: it has no TOPIC and no --duration", code=exit_codes.USAGE)
    swarm = console.read_spec(where.spec)
    names = selected.hosts(swarm.candidates, where.limit)
    reach = where.targets(swarm)
    targets = [reach[name] for name in names]
    hosts = RecordingHosts(swarm, targets, transport(), where.complete, where.parallel, json=json)
    if not fetch:
        shapes = topics or ["*"]
        accounts = {name: target.user for name, target in reach.items()}
        found = hosts.start(requests(swarm, accounts, shapes, seconds=duration, megabytes=size))
        for shape in shapes if hosts.exit_code() == exit_codes.OK else ():
            if not any(fnmatchcase(one, shape) for of_host in found.values() for one in of_host):
                console.show(f"warning: nothing publishes {shape}", error=True)
        if not found:
            raise typer.Exit(hosts.exit_code() or exit_codes.ERROR)
        hosts.watch()
    place = folder or Path(f"{swarm.name}-bags")
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        console.fail(console.cannot_write(error, place))
    out = ["--out", str(folder)] if folder else []
    hosts.fetch(place, where.spec.command("record", "--fetch", *out, *where.options))
    if json:
        console.print_json(hosts.document())
    elif hosts.have_bags:
        next_command.advise("ui", where.spec, "--bags", str(place))
    raise typer.Exit(hosts.exit_code())
