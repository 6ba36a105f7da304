"""``swarmctl ready``: whether a trial can begin, as a table of what it needs."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, options
from swarmctl.cli.where import Where, with_where


@with_where("parallel", parallel=options.PARALLEL_URGENT)
def ready(
    where: Where,
    name: Annotated[
        str,
        typer.Argument(
            metavar="[EXPERIMENT]", show_default=False, help="With its robots, programs and thresholds."
        ),
    ] = "",
    json: options.Json = False,
) -> None:
    """Show whether a trial can begin: hosts, release, clocks, disks, batteries, devices, drivers, topics.

    Exit code 5 if not. Nothing is stopped or started.
    """
    from swarmctl.cli import readiness_look, ssh_targets, swarm_look
    from swarmctl.cli.verbs.run import experiment_of
    from swarmctl.spec.experiment_model import Experiment
    from swarmctl.views.readiness import table

    wanted = swarm_look.expected(where)
    spec = wanted.document.spec
    experiment = experiment_of(spec, name) if name else Experiment(duration=1.0)
    targets, transport = where.targets(wanted.swarm), ssh_targets.transport()
    looking = swarm_look.looking_at(
        wanted, targets, transport, window=options.WINDOW, parallel=where.parallel
    )
    _, found = readiness_look.look(wanted.swarm, experiment, looking, targets, transport, where.parallel)
    go = all(one.go for one in found)
    if json:
        rows = [one._asdict() for one in found]
        console.print_json({"v": 1, "swarm": spec.name, "experiment": name, "ready": go, "items": rows})
    else:
        console.out().print(table(found))
        if not go:
            where.advise("status")
    raise typer.Exit(exit_codes.OK if go else exit_codes.UNHEALTHY)
