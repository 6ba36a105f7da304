"""``swarmctl rollback``: bring hosts back to releases that they have kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, deploy_steps, exit_codes, options, rollout_output, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.plan.waves import Consistency


@with_where("limit", "parallel", "executor", "no_reuse")
def rollback(
    where: Where,
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="RUN|RELEASE",
            help="The state after this run of `swarmctl history`, or this release; else before the last run.",
        ),
    ] = "",
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not show the plan and ask first.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show the plan. Changes nothing.")] = False,
    keep_going: Annotated[
        bool,
        typer.Option("--keep-going", help="Each host by itself; without it, all go back or none does."),
    ] = False,
    stop_robots: options.StopRobots = False,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Bring hosts back to the releases that they had before the last run. They need no file from here."""
    from swarmctl.deploy.outcome import Rules
    from swarmctl.deploy.rollback import Rollback
    from swarmctl.plan.robots_in_use import Dependents
    from swarmctl.plan.waves import order
    from swarmctl.remote.parallel_hosts import Stop
    from swarmctl.render.build_bundle import bundles

    document = console.read_document(where.spec)
    swarm = where.swarm(document)
    made = bundles(swarm)
    names = selected.hosts(swarm.candidates, where.limit)
    stop = Stop()
    targets = where.targets(swarm)
    together: Consistency = "independent" if keep_going else "all"
    view = deploy_steps.View("rollback", swarm, where, details=details, json=json)
    with where.transport() as transport:
        going_back = Rollback(
            {name: made[name] for name in names}, targets, transport,
            to=to, dependents=Dependents(swarm), parallel=where.parallel, stop=stop, recovers=not dry_run,
            rules=Rules(
                None if keep_going else 0, [name for name in names if swarm.hosts[name].optional],
                stop_robots=stop_robots,
            ),
        )  # fmt: skip
        found = view.executed(
            going_back, stop, lambda one: order(one.due, (), ("100%",), together), dry_run=dry_run, yes=yes
        )
    absent = rollout_output.absent(found, swarm.hosts)
    if json:
        console.print_json(rollout_output.document(swarm.name, found))
    else:
        rollout_output.report(
            swarm, found, where.complete, absent,
            details=details, interrupted=stop.requested,
        )  # fmt: skip
    code = rollout_output.exit_code(found, interrupted=stop.requested, absent=absent)
    if going_back.problem and code == exit_codes.OK:
        listing = where.command("history")
        console.fail(f"nothing was changed: {going_back.problem}", f"`{listing}` lists the runs")
    if not where.in_lab:
        where.guess_lab("rollback", swarm.name, rollout_output.errors(found))
    if not json and code == exit_codes.OK:
        console.show("note: the spec is as it was: a deploy brings its release again", error=True)
        where.advise("status")
    raise typer.Exit(code)
