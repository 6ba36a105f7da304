"""``swarmctl plan``: what each host would get, and why."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import access, console, exits

if TYPE_CHECKING:
    from collections.abc import Mapping, Set

    from swarmctl.plan.plan import Plan
    from swarmctl.render.bundle import Bundle

WEAKEST = 3  # single points of failure that a plan names


def plan(
    spec: access.Spec,
    overlays: access.Overlays = None,
    diff: Annotated[bool, typer.Option("--diff", help="Show each changed file as a unified diff.")] = False,
    offline: Annotated[
        bool, typer.Option("--offline", help="Ask no host; compare with the last deploy made from here.")
    ] = False,
    detailed_exitcode: Annotated[
        bool, typer.Option("--detailed-exitcode", help="Exit with 2 when there is something to do.")
    ] = False,
    lab: access.Lab = False,
    lab_name: access.LabName = "",
    limit: access.Limit = None,
    parallel: access.Parallel = 64,
    json: access.Json = False,
) -> None:
    """Show what a deploy would do on each host, step by step, with the cause of each. Changes nothing."""
    from swarmctl.render.host import bundles
    from swarmctl.topology.impact import impacts, single_points
    from swarmctl.topology.resolve import resolve
    from swarmctl.views import plan as view

    document = console.read_document(spec)
    swarm = resolve(document)
    wanted = bundles(swarm)
    wanted = {name: wanted[name] for name in access.chosen(wanted, limit)}
    if offline:
        made = _offline(wanted, diff)
    else:
        from swarmctl.deploy.rollout import observe
        from swarmctl.remote.ssh import SshTransport

        secrets = access.secrets(spec, wanted)
        targets = access.targets(spec, swarm, lab=lab, lab_name=lab_name)
        made = observe(wanted, targets, SshTransport(), diff=diff, parallel=parallel, secrets=secrets)
    made = replace(made, single_points=single_points(impacts(document.spec))[:WEAKEST])
    if json:
        console.print_json(made.to_json())
    else:
        console.out().print(view.plan(made, diff=diff))
    optional = {host.name for host in swarm.hosts.values() if host.optional}
    raise typer.Exit(exit_code(made, optional, detailed_exitcode))


def _offline(wanted: Mapping[str, Bundle], diff: bool) -> Plan:
    from swarmctl.deploy import journal
    from swarmctl.plan.plan import Plan
    from swarmctl.plan.reconcile import reconcile

    swarm = next(iter(wanted.values())).swarm
    place = journal.folder(swarm)
    hosts = (reconcile(bundle, journal.recall(place, name), diff=diff) for name, bundle in wanted.items())
    return Plan(swarm, tuple(hosts))


def exit_code(made: Plan, optional: Set[str], detailed: bool) -> int:
    """An optional host that is away is no problem: the swarm is complete without it."""
    kinds = {host.host: host.problem.kind for host in made.problems if host.problem}
    kinds = {host: kind for host, kind in kinds.items() if kind != "unreachable" or host not in optional}
    if kinds:
        unreachable = set(kinds.values()) == {"unreachable"}
        return exits.HOSTS_UNREACHABLE if unreachable else exits.HOSTS_FAILED
    return exits.CHANGES if detailed and made.changes else exits.OK
