"""``swarmctl plan``: the steps of a deploy on each host, and their causes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import (
    console,
    executors,
    exit_codes,
    forgotten_lab,
    left_hosts,
    next_command,
    options,
    rollout_output,
    saved_plan,
    selected,
    weakest,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.plan.plan import Plan
    from swarmctl.render.bundle import Bundle


def plan(
    spec: options.Spec,
    overlays: options.Overlays = None,
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
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = options.PARALLEL,
    executor: executors.Executor = "",
    no_reuse: executors.NoReuse = False,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Show the steps of a deploy on each host, with their causes. Changes nothing."""
    from swarmctl.render.build_bundle import bundles
    from swarmctl.views.equal_hosts import names_of
    from swarmctl.views.plan import PlanView

    if offline and saved:
        console.fail("--offline and --out exclude each other", code=exit_codes.USAGE)
    if offline and executor:
        console.fail("--offline and --executor exclude each other", code=exit_codes.USAGE)
    document = console.read_document(spec)
    swarm = console.swarm_of(document, options.lab_of(document, lab, lab_name))
    wanted = bundles(swarm)
    wanted = {name: wanted[name] for name in selected.hosts(swarm.candidates, limit)}
    lists = left_hosts.lists_of(swarm)
    if offline:
        made = _offline(wanted, diff)
    else:
        from swarmctl.deploy.rollout import observe

        secrets = options.secrets(spec, wanted)
        targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
        in_lab = options.in_lab(lab, lab_name)
        with executors.transport(
            executor, in_lab=in_lab, secrets=bool(secrets), reuse=not no_reuse
        ) as transport:
            made = observe(
                wanted, targets, transport, diff=diff, parallel=parallel, secrets=secrets,
                host_lists=lists,
            )  # fmt: skip
    made = weakest.named(made, document)
    if saved:
        found = saved_plan.hosts_of(made)
        saved_plan.SavedPlan(spec, lab, lab_name, limit, found).write(saved)
    left = left_hosts.left_hosts(swarm, lists, in_lab=options.in_lab(lab, lab_name))
    if json:
        console.print_json(made.to_json() | {"left_hosts": sorted((*left[0], *left[1]))})
    else:
        where = next_command.where(lab=lab, lab_name=lab_name, limit=limit, executor=executor)
        complete = next_command.completing(spec, where)
        view = PlanView(names_of(swarm), diff, details, console.columns(), complete)
        console.out().print(view.text(made))
        if not options.in_lab(lab, lab_name):
            kinds = [host.problem.kind for host in made.problems if host.problem]
            forgotten_lab.guess("plan", spec, swarm.name, kinds, limit)
        _advise(made, spec, where, in_lab=options.in_lab(lab, lab_name))
        rollout_output.warn_of_left_hosts(left, spec, next_command.where(lab=lab, lab_name=lab_name))
    optional = {host.name for host in swarm.hosts.values() if host.optional}
    raise typer.Exit(exit_codes.of_plan(made, optional, detailed=detailed_exitcode))


def _advise(made: Plan, spec: SpecFiles, where: list[str], *, in_lab: bool) -> None:
    """What comes after a plan: keys to pin, hosts to prepare, a deploy, or a look at the running swarm."""
    from swarmctl.plan.preflight import PREPARE_INSTALLS

    kinds = {host.problem.kind for host in made.problems if host.problem}
    if "host-key" in kinds and not in_lab:
        next_command.advise("trust", spec, *where)
    elif any(host.problem.hint.startswith(PREPARE_INSTALLS) for host in made.problems if host.problem):
        next_command.advise("prepare", spec, *where)
    elif made.changes:
        next_command.advise("deploy", spec, *where)
    elif not kinds:
        next_command.advise("status", spec, *where)


def _offline(wanted: Mapping[str, Bundle], diff: bool) -> Plan:
    from swarmctl.deploy import journal
    from swarmctl.plan.plan import Plan
    from swarmctl.plan.reconcile import reconcile

    swarm = next(iter(wanted.values())).swarm
    place = journal.folder(swarm)
    hosts = (reconcile(bundle, journal.recall(place, name), diff=diff) for name, bundle in wanted.items())
    return Plan(swarm, tuple(hosts))
