"""``swarmctl adopt``: brings edits of hosts into the files of the spec."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmctl.cli import adopting, console, executors, exit_codes, next_command, options, selected


def adopt(
    spec: options.Spec,
    overlays: options.Overlays = None,
    into: options.Into = None,
    write: Annotated[
        bool, typer.Option("--write", help="Write the files; by default the edit is only shown.")
    ] = False,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = options.PARALLEL,
    executor: executors.Executor = "",
    no_reuse: executors.NoReuse = False,
) -> None:
    """Bring what was edited on hosts into the files of the spec. Changes nothing on a host.

    Exit code 1 if an edit cannot be brought into the spec.
    """
    document = console.read_document(spec)
    swarm = console.swarm_of(document, options.lab_of(document, lab, lab_name))
    names = selected.hosts(swarm.candidates, limit)
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    in_lab = options.in_lab(lab, lab_name)
    with executors.transport(executor, in_lab=in_lab, reuse=not no_reuse) as transport:
        found, errors = adopting.found(
            spec, names, targets, transport, into=into, parallel=parallel,
            lab=options.lab_of(document, lab, lab_name),
        )  # fmt: skip
    adopting.show(found)
    for error in errors:
        console.show(error, error=True)
    if not found.texts:
        if not found.refused and not errors:
            console.show("no host has an edit that the spec has not")
    elif write:
        adopting.write(found)
    where = next_command.where(lab=lab, lab_name=lab_name, limit=limit, executor=executor)
    if found.texts and write:
        next_command.advise("plan", spec, *where)
    elif found.texts:
        more = ["--into", str(into)] if into else []
        next_command.advise("adopt", spec, *where, *more, "--write")
    code = exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK
    raise typer.Exit(exit_codes.ERROR if found.refused else code)
