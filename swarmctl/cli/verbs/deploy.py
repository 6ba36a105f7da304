"""``swarmctl deploy``: install the release of each host."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from swarmctl.cli import (
    adopting,
    console,
    deploy_steps,
    exit_codes,
    options,
    rollout_output,
    saved_plan,
    selected,
)
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from swarmctl.deploy.outcome import Result


@with_where("limit", "parallel", "executor", "no_reuse")
def deploy(
    where: Where,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not show the plan and ask first.")] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show the plan and the order of the hosts. Changes nothing.")
    ] = False,
    keep_going: Annotated[
        bool,
        typer.Option("--keep-going", help="Change the other hosts whatever becomes of some."),
    ] = False,
    max_fail: Annotated[
        int | None,
        typer.Option(
            "--max-fail",
            min=0,
            metavar="N",
            help="Hold the other hosts back once more than N are unfit, unreachable or fail; by default 0, "
            "where one that does not answer counts only if all change together.",
        ),
    ] = None,
    when_seen: Annotated[
        bool,
        typer.Option(
            "--when-seen",
            help="Go on until the hosts that do not answer, or whose robots are in use, have the release.",
        ),
    ] = False,
    retry_failed: Annotated[
        bool,
        typer.Option("--retry-failed", help="Only the hosts that failed in the last deploy, or were held."),
    ] = False,
    serial: Annotated[
        str,
        typer.Option(
            "--serial",
            metavar="SIZES",
            help="Hosts that change at a time, such as 1,25%,100%; by default one, a quarter, the rest.",
        ),
    ] = "",
    consistency: Annotated[
        Literal["independent", "wave", "all"] | None,
        typer.Option(
            "--consistency",
            help="Hosts that stay changed or go back together; by default all if the master or mode changes.",
        ),
    ] = None,
    healthy_for: Annotated[
        float,
        typer.Option(
            "--healthy-for",
            min=0,
            max=300,
            metavar="SECONDS",
            help="Undo the change of a host whose units do not run for so long without a restart.",
        ),
    ] = 6.0,
    confirm_within: Annotated[
        float,
        typer.Option(
            "--confirm-within",
            min=10,
            max=3600,
            metavar="SECONDS",
            help="A host undoes its change unless a new connection confirms it within so long.",
        ),
    ] = 60.0,
    stop_robots: options.StopRobots = False,
    overwrite_edits: Annotated[
        bool,
        typer.Option(
            "--overwrite-edits",
            help="Replace files that were edited on the hosts, which keep a copy; with --adopt, only those "
            "whose edit the spec cannot take.",
        ),
    ] = False,
    adopt: Annotated[
        bool,
        typer.Option("--adopt", help="First write into the spec what was edited on hosts (see `adopt`)."),
    ] = False,
    into: options.Into = None,
    wait: Annotated[
        float,
        typer.Option(
            "--wait",
            min=0,
            max=86_400,
            metavar="SECONDS",
            help="Wait so long for robots that are in use, or whose `maintenance` does not hold yet.",
        ),
    ] = 0.0,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Deploy the spec to its hosts, wave by wave. Only units that changed restart; nothing changes before all
    hosts are known to be fit."""
    from swarmctl.cli import deploy_rounds
    from swarmctl.deploy import journal
    from swarmctl.deploy.host_transaction import Terms
    from swarmctl.deploy.outcome import WAITS, Rules
    from swarmctl.remote.parallel_hosts import Stop
    from swarmctl.remote.transport import Kind
    from swarmctl.render.build_bundle import bundles

    sizes = deploy_steps.sizes(serial)
    if saved := saved_plan.read(where.spec):
        where = saved.applied(where)
    if saved and when_seen:
        console.fail("--when-seen and a saved plan exclude each other", code=exit_codes.USAGE)
    adopting.check_options(adopt=adopt, into=into, saved=saved is not None)
    if adopt:
        where = adopting.before_deploy(
            where, into, yes=yes, writes=not dry_run, overwrites=overwrite_edits, quiet=json
        )
    document = console.read_document(where.spec)
    swarm = where.swarm(document)
    wanted = bundles(swarm)
    if retry_failed:
        failed = journal.failed(journal.folder(swarm.name), lab=where.in_lab)
        where = where.limited(*_failed(failed, swarm.hosts, where.limit))
    wanted = {name: wanted[name] for name in selected.hosts(swarm.candidates, where.limit)}
    rules = Rules(
        None if keep_going else max_fail or 0,
        [name for name in wanted if swarm.hosts[name].optional],
        Terms(healthy_for, max(30.0, 4 * healthy_for), confirm_within),
        stop_robots,
        wait,
        overwrite_edits,
        WAITS if when_seen else (Kind.UNREACHABLE,) if max_fail is None else (),
        when_seen,
    )
    view = deploy_steps.View("deploy", swarm, where, details=details, json=json)
    rounds = deploy_rounds.Rounds(where, document, view, wanted, rules, sizes, consistency, Stop())
    found = rounds.first(dry_run=dry_run, yes=yes, saved=saved)
    if when_seen:
        found = rounds.until_all_are_seen(found)
    absent = rollout_output.absent(found, swarm.hosts)
    if json:
        console.print_json(rollout_output.document(swarm.name, found))
    code = rollout_output.exit_code(found, interrupted=rounds.stop.requested, absent=absent)
    if not json:
        _advise(where, found, absent, code)
    raise typer.Exit(code)


def _failed(failed: list[str], hosts: Collection[str], limit: list[str] | None) -> list[str]:
    """Returns the hosts to try again; exits if there are none."""
    if limit:
        console.fail("--retry-failed and --limit exclude each other", code=exit_codes.USAGE)
    if again := [name for name in failed if name in hosts]:
        return again
    console.show("no host failed in the last deploy from this machine")
    raise typer.Exit(exit_codes.OK)


def _advise(where: Where, found: Mapping[str, Result], absent: tuple[str, ...], code: int) -> None:
    """What comes after a deploy: hosts to prepare, to leave out or to try again, or a look at the swarm."""
    from swarmctl.plan.preflight import PREPARE_INSTALLS

    lacking = rollout_output.unfit(found, PREPARE_INSTALLS)
    if lacking:
        preparing = where.command("prepare")
        console.err().print(f"help: `{preparing}` makes {lacking} fit")
    if rollout_output.held(found):
        going = where.command("deploy", "--keep-going")
        console.err().print(f"help: `{going}` changes the other hosts without them")
    if code == exit_codes.OK:
        where.advise("status")
    elif code != exit_codes.INTERRUPTED and not lacking:
        rollout_output.advise_again("deploy", where, found, absent)
