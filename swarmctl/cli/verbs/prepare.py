"""``swarmctl prepare``: install on each host what its robots and programs need."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, options, rollout_output, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence, Set

    from swarmctl.deploy.outcome import Result
    from swarmctl.plan.host_builds import Build
    from swarmctl.plan.host_preparation import HostPreparation
    from swarmctl.plan.plan import Problem
    from swarmctl.remote.parallel_hosts import Stop
    from swarmctl.remote.transport import Target
    from swarmctl.swarm.resolved import Swarm


def planned(swarm: Swarm, seen: Sequence[HostPreparation], lab: str) -> tuple[HostPreparation, ...]:
    """Returns the preparations with the builds that are due; remembers the platforms of the hosts."""
    from swarmctl.plan import host_builds

    platforms = {host.host: host.platform for host in seen if host.platform}
    builds, problems = _due(swarm, platforms, [host.host for host in seen], lab)
    return host_builds.planned(seen, builds, problems)


def carried_out(
    swarm: Swarm,
    found: Mapping[str, Result],
    observe: Callable[[], Sequence[HostPreparation]],
    targets: Mapping[str, Target],
    lab: str,
    *,
    parallel: int,
    stop: Stop,
    quiet: bool,
) -> Mapping[str, Result]:
    """Builds what hosts need, even those that lack something else; returns the results of all hosts.

    ``observe`` looks at the prepared hosts again.
    """
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy.build_store import build, store
    from swarmctl.deploy.prepare import Prepared
    from swarmctl.plan.host_builds import keys_of
    from swarmctl.plan.plan import Problem
    from swarmctl.remote.transport import HostError, Kind
    from swarmctl.ros_packages.builds import without_ros

    if not _any(swarm):
        return found
    # One without ROS has failed; what would be built for it is not known.
    seen = {host.host: host.platform for host in observe() if host.platform}
    platforms = {host: one for host, one in seen.items() if one != without_ros(one)}
    builds, problems = _due(swarm, platforms, list(found), lab)
    results = dict(found)
    if builds:
        events = build(swarm, builds, targets, transport(), store(), parallel=parallel, stop=stop)
        built = rollout_output.results(events, [one.builder for one in builds], quiet=quiet)
        results |= {name: _with(found[name], one) for name, one in built.items()}
    unknown = Problem("lacks", "a ROS whose version is known", "install roslaunch there")
    problems = {**dict.fromkeys((one for one in seen if one not in platforms), unknown), **problems}
    for name, problem in problems.items():
        if isinstance(results[name], Prepared) and keys_of(swarm, name, seen[name]):
            results[name] = HostError(Kind.REFUSED, f"it still lacks {problem.message}", problem.hint)
    return results


def _any(swarm: Swarm) -> bool:
    from swarmctl.swarm.used_packages import in_swarm

    return any(one.built_by for one in in_swarm(swarm))


def _due(
    swarm: Swarm, platforms: Mapping[str, str], hosts: Collection[str], lab: str
) -> tuple[tuple[Build, ...], Mapping[str, Problem]]:
    from swarmctl.deploy.build_store import remember_platforms, store
    from swarmctl.plan.host_builds import builds_of

    if not _any(swarm):
        return (), {}
    try:
        remember_platforms(swarm.name, lab, platforms, swarm.hosts)
    except OSError as error:
        console.fail(
            console.cannot_write(error, "the platforms of the hosts"), "free space, or set XDG_STATE_HOME"
        )
    return builds_of(swarm, platforms, store().keys(), hosts)


def _with(before: Result, built: Result) -> Result:
    """The result of a builder: its own preparation, then its build."""
    from swarmctl.deploy.prepare import Prepared

    if isinstance(before, Prepared) and isinstance(built, Prepared):
        return replace(built, steps=(*before.steps, *built.steps))
    return built if isinstance(before, Prepared) else before


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
        seen = planned(swarm, observe(), lab)
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
            found = carried_out(
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
