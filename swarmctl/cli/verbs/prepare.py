"""``swarmctl prepare``: install on each host what its robots and programs need."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, options, package_builds, rollout_output, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from collections.abc import Sequence, Set

    from swarmctl.plan.host_preparation import HostPreparation


@with_where("limit", "parallel")
def prepare(
    where: Where,
    plan: Annotated[
        bool, typer.Option("--plan", help="Show what would be done, and change nothing.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask for confirmation.")] = False,
    login: Annotated[
        str,
        typer.Option(
            "--login",
            metavar="ACCOUNT",
            help="Log in with this account, root or one with password-free sudo, of a host that lacks the "
            "account of the spec.",
        ),
    ] = "",
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Install on each host what it lacks: account, packages, groups, built workspace. Asks first."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy import prepare as hosts
    from swarmctl.plan.host_needs import needs_of
    from swarmctl.remote.parallel_hosts import interruptible
    from swarmctl.render.build_bundle import bundles
    from swarmctl.views.equal_hosts import names_of
    from swarmctl.views.preparation import PreparationView

    if json and not (plan or yes):
        console.fail(
            "`--json` asks no question", "add --yes to prepare the hosts, or --plan to see what they lack"
        )
    document = console.read_document(where.spec)
    lab = where.lab_of(document.spec.name)
    swarm = where.swarm(document)
    made = bundles(swarm)
    names = selected.hosts(swarm.candidates, where.limit)
    wanted = {name: needs_of(swarm, swarm.hosts[name], made[name]) for name in names}
    targets = where.targets(swarm)
    complete = where.complete
    optional = {name for name in names if swarm.hosts[name].optional}

    def observe() -> tuple[HostPreparation, ...]:
        return hosts.observe(wanted, targets, transport(), login=login, parallel=where.parallel)

    if not yes or plan:
        seen = package_builds.planned(swarm, observe(), lab)
        if json:
            console.print_json({"v": 1, "swarm": swarm.name, "hosts": [host.to_json() for host in seen]})
        else:
            view = PreparationView(names_of(swarm), console.columns(), complete, details)
            console.out().print(view.text(seen))
        if plan or not any(host.steps for host in seen):
            code = exit_code(seen, optional)
            if code == exit_codes.OK and not json:
                _advise(where, seen, login)
            raise typer.Exit(code)
        _confirm(seen)
    with interruptible(rollout_output.note) as stop:
        events = hosts.prepare(wanted, targets, transport(), login=login, parallel=where.parallel, stop=stop)
        found = rollout_output.results(events, names, quiet=json)
        if not stop.requested:
            found = package_builds.carried_out(
                swarm, found, observe, targets, lab, parallel=where.parallel, stop=stop, quiet=json
            )
    absent = rollout_output.absent(found, swarm.hosts)
    if json:
        console.print_json(rollout_output.document(swarm.name, found))
    else:
        rollout_output.report(
            swarm, found, complete, absent,
            details=details, interrupted=stop.requested,
        )  # fmt: skip
    code = rollout_output.exit_code(found, interrupted=stop.requested, absent=absent)
    if code == exit_codes.OK and not json:
        where.advise("deploy")
    elif not json and code != exit_codes.INTERRUPTED:
        rollout_output.advise_again("prepare", where, found, absent)
    raise typer.Exit(code)


def _advise(where: Where, seen: Sequence[HostPreparation], login: str) -> None:
    """After a plan: carry it out, or deploy if there is nothing to do."""
    if any(host.steps for host in seen):
        account = ["--login", login] if login else []
        where.advise("prepare", *account)
    else:
        where.advise("deploy")


def exit_code(seen: Sequence[HostPreparation], optional: Set[str]) -> int:
    """The exit code of a plan: what no step provides counts, and steps do not."""
    problems = {host.host: host.problem.kind for host in seen if host.problem}
    problems |= {host.host: "lacks" for host in seen if host.lacks}
    kinds = {kind for host, kind in problems.items() if kind != "unreachable" or host not in optional}
    if kinds == {"unreachable"}:
        return exit_codes.HOSTS_UNREACHABLE
    return exit_codes.HOSTS_FAILED if kinds else exit_codes.OK


def _confirm(seen: Sequence[HostPreparation]) -> None:
    """Ask on a terminal; exits without one, and for every answer but `yes`."""
    from swarmctl.yamltext import hostlist

    names = hostlist.written(host.host for host in seen if host.steps)
    if not sys.stdin.isatty():
        console.fail("there is no terminal to ask on", "read the list, then run the same command with --yes")
    answer = typer.prompt(f"Prepare {names}? (yes)", default="no", err=True)
    if str(answer) != "yes":
        console.fail("nothing was changed", "answer `yes`, or use --yes in scripts")
