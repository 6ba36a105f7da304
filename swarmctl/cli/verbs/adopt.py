"""``swarmctl adopt``: brings edits of hosts into the files of the spec."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmctl.cli import adopting, console, exit_codes, options, selected
from swarmctl.cli.where import Where, with_where


@with_where("limit", "parallel", "executor", "no_reuse")
def adopt(
    where: Where,
    into: options.Into = None,
    write: Annotated[
        bool, typer.Option("--write", help="Write the files; by default the edit is only shown.")
    ] = False,
) -> None:
    """Bring what was edited on hosts into the files of the spec. Changes nothing on a host.

    Exit code 1 if an edit cannot be brought into the spec.
    """
    document = console.read_document(where.spec)
    swarm = where.swarm(document)
    names = selected.hosts(swarm.candidates, where.limit)
    targets = where.targets(swarm)
    with where.transport() as transport:
        found, errors = adopting.found(where, names, targets, transport, into)
    adopting.show(found)
    for error in errors:
        console.show(error, error=True)
    if not found.texts:
        if not found.refused and not errors:
            console.show("no host has an edit that the spec has not")
    elif write:
        adopting.write(found)
    if found.texts and write:
        where.advise("plan")
    elif found.texts:
        more = ["--into", str(into)] if into else []
        where.advise("adopt", *more, "--write")
    code = exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK
    raise typer.Exit(exit_codes.ERROR if found.refused else code)
