"""``swarmctl plan``: the steps of a deploy on each host, and their causes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import (
    console,
    deploy_steps,
    exit_codes,
    left_hosts,
    options,
    rollout_output,
    saved_plan,
    selected,
)
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from collections.abc import Mapping

    from swarmctl.plan.plan import Plan
    from swarmctl.render.bundle import Bundle


@with_where("limit", "parallel", "executor", "no_reuse")
def plan(
    where: Where,
    diff: Annotated[bool, typer.Option("--diff", help="Show each changed file as a unified diff.")] = False,
    offline: Annotated[
        bool,
        typer.Option("--offline", help="Connect to no host; compare with the last deploy from this machine."),
    ] = False,
    detailed_exitcode: Annotated[
        bool, typer.Option("--detailed-exitcode", help="Exit with 2 if there are changes.")
    ] = False,
    saved: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="Write the plan for `swarmctl deploy FILE`."),
    ] = None,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Show the steps of a deploy on each host, with their causes. Changes nothing."""
    from swarmctl.render.build_bundle import bundles
    from swarmctl.views.equal_hosts import names_of
    from swarmctl.views.plan import PlanView

    if offline and saved:
        console.fail("--offline and --out exclude each other", code=exit_codes.USAGE)
    if offline and where.executor:
        console.fail("--offline and --executor exclude each other", code=exit_codes.USAGE)
    document = console.read_document(where.spec)
    swarm = where.swarm(document)
    wanted = bundles(swarm)
    wanted = {name: wanted[name] for name in selected.hosts(swarm.candidates, where.limit)}
    lists = left_hosts.lists_of(swarm)
    if offline:
        made = _offline(wanted, diff)
    else:
        from swarmctl.deploy.rollout import observe

        secrets = where.secrets(wanted)
        targets = where.targets(swarm)
        with where.transport(secrets=bool(secrets)) as transport:
            made = observe(
                wanted, targets, transport, diff=diff, parallel=where.parallel, secrets=secrets,
                host_lists=lists,
            )  # fmt: skip
    made = deploy_steps.with_single_points(made, document)
    if saved:
        saved_plan.SavedPlan(where, saved_plan.hosts_of(made)).write(saved)
    left = left_hosts.left_hosts(swarm, lists, in_lab=where.in_lab)
    if json:
        console.print_json(made.to_json() | {"left_hosts": sorted((*left[0], *left[1]))})
    else:
        view = PlanView(names_of(swarm), diff, details, console.columns(), where.complete)
        console.out().print(view.text(made))
        if not where.in_lab:
            kinds = [host.problem.kind for host in made.problems if host.problem]
            where.guess_lab("plan", swarm.name, kinds)
        _advise(made, where)
        rollout_output.warn_of_left_hosts(left, where)
    optional = {host.name for host in swarm.hosts.values() if host.optional}
    raise typer.Exit(exit_codes.of_plan(made, optional, detailed=detailed_exitcode))


def _advise(made: Plan, where: Where) -> None:
    """What comes after a plan: keys to pin, hosts to prepare, a deploy, or a look at the running swarm."""
    from swarmctl.plan.preflight import PREPARE_INSTALLS

    kinds = {host.problem.kind for host in made.problems if host.problem}
    if "host-key" in kinds and not where.in_lab:
        where.advise("trust")
    elif any(host.problem.hint.startswith(PREPARE_INSTALLS) for host in made.problems if host.problem):
        where.advise("prepare")
    elif made.changes:
        where.advise("deploy")
    elif not kinds:
        where.advise("status")


def _offline(wanted: Mapping[str, Bundle], diff: bool) -> Plan:
    from swarmctl.deploy import journal
    from swarmctl.plan.plan import Plan
    from swarmctl.plan.reconcile import reconcile

    swarm = next(iter(wanted.values())).swarm
    place = journal.folder(swarm)
    hosts = (reconcile(bundle, journal.recall(place, name), diff=diff) for name, bundle in wanted.items())
    return Plan(swarm, tuple(hosts))
