"""``swarmctl remove``: remove the swarm from its hosts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    orphan_selection,
    rollout_output,
    selected,
)

if TYPE_CHECKING:
    from swarmctl.deploy.host_lists import HostLists, LeftHost
    from swarmctl.remote.transport import Target


def remove(
    spec: options.Spec,
    overlays: options.Overlays = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask for confirmation.")] = False,
    orphans: Annotated[
        bool,
        typer.Option(
            "--orphans",
            help="Only from hosts that the spec has no more, as this machine and the other hosts know.",
        ),
    ] = False,
    forget: Annotated[
        bool,
        typer.Option(
            "--forget", help="With --orphans: hosts that are gone for good; they are not contacted."
        ),
    ] = False,
    stop_robots: options.StopRobots = False,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = options.PARALLEL,
    executor: executors.Executor = "",
    no_reuse: executors.NoReuse = False,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Remove the swarm from its hosts: stop the robots; remove units, links and /opt/swarm/<name>."""
    from swarmctl.cli.ssh_targets import read_known_hosts
    from swarmctl.deploy import rollout
    from swarmctl.deploy.outcome import Removed
    from swarmctl.plan.robots_in_use import Dependents
    from swarmctl.remote.parallel_hosts import interruptible

    swarm = console.read_spec(spec)
    in_lab = options.in_lab(lab, lab_name)
    if forget and not (orphans and limit):
        console.fail(
            "--forget needs --orphans and --limit with the names of the hosts", code=exit_codes.USAGE
        )
    lists = left_hosts.lists_of(swarm)
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    if orphans:
        _read_lists(lists, targets, executor, in_lab=in_lab, parallel=parallel)
    found_left = left_hosts.left_hosts(swarm, lists, in_lab=in_lab) if orphans else ({}, [])
    if forget:
        names = orphan_selection.chosen([*found_left[0], *found_left[1]], limit)
        if not yes and not _confirmed(
            swarm.name, names, "Forget {swarm} on {hosts}, which keep what runs there?"
        ):
            console.fail("nothing was forgotten", "answer `yes`, or use --yes in scripts")
        _forget(lists, names, targets, executor, in_lab=in_lab, parallel=parallel, logged=True)
        _show_forgotten(swarm.name, names, json=json)
        raise typer.Exit(exit_codes.OK)
    left: dict[str, LeftHost] = {}
    if orphans:
        known = None if in_lab else read_known_hosts(spec.first)
        left = orphan_selection.to_contact(swarm, found_left, limit, known, yes=yes)
        targets = options.targets(spec, left_hosts.with_left(swarm, left), lab=lab, lab_name=lab_name)
    names = list(left) or selected.hosts(swarm.candidates, limit)
    if not yes and not _confirmed(swarm.name, names):
        console.fail("nothing was removed", "answer `yes`, or use --yes in scripts")
    with (
        executors.transport(executor, in_lab=in_lab, reuse=not no_reuse) as transport,
        interruptible(rollout_output.note) as stop,
    ):
        events = rollout.remove(
            names, targets, transport,
            dependents=Dependents(swarm), parallel=parallel, stop=stop, stop_robots=stop_robots,
        )  # fmt: skip
        found = rollout_output.results(events, names, quiet=json)
    if json:
        console.print_json(rollout_output.document(swarm.name, found))
    else:
        where = next_command.where(lab=lab, lab_name=lab_name, limit=limit, executor=executor)
        rollout_output.report(
            swarm, found, next_command.completing(spec, where),
            details=details, interrupted=stop.requested,
        )  # fmt: skip
    if not in_lab:
        forgotten_lab.guess("remove", spec, swarm.name, rollout_output.errors(found), limit)
    gone = [name for name, result in found.items() if isinstance(result, Removed)]
    if orphans and gone:
        _forget(lists, gone, targets, executor, in_lab=in_lab, parallel=parallel)
    elif not in_lab:
        _forget_here(swarm.name, gone)
    code = rollout_output.exit_code(found, interrupted=stop.requested)
    if not json and code not in (exit_codes.OK, exit_codes.INTERRUPTED):
        rollout_output.advise_again("remove", spec, found, lab=lab, lab_name=lab_name, executor=executor)
    raise typer.Exit(code)


def _read_lists(
    lists: HostLists, targets: Mapping[str, Target], executor: str, *, in_lab: bool, parallel: int
) -> None:
    """Reads which hosts the hosts of the spec name."""
    from swarmctl.deploy.host_list_updates import read_all
    from swarmctl.views.escape import printable

    errors = read_all(lists, targets.values(), lambda: executors.transport(executor, in_lab=in_lab), parallel)
    for host, error in errors.items():
        console.err().print(
            f"warning: the list of hosts of {host} is not known ({error.kind.value}: {printable(str(error))})"
        )


def _forget(
    lists: HostLists,
    names: Sequence[str],
    targets: Mapping[str, Target],
    executor: str,
    *,
    in_lab: bool,
    parallel: int,
    logged: bool = False,
) -> None:
    """Removes hosts from the lists of the others and from the journal; ``logged``: in the history, too."""
    from swarmctl.deploy.host_list_updates import write_all_anew

    wanted = lists.wanted((), lists.spec, names)
    hosts = lists.hosts if logged else lists.outdated(lists.hosts, wanted)
    errors = write_all_anew(
        lists, wanted, [targets[host] for host in hosts],
        lambda: executors.transport(executor, in_lab=in_lab),
        forgotten=names if logged else (), parallel=parallel,
    )  # fmt: skip
    for host in errors:
        console.err().print(
            f"warning: {host} did not take the new list of hosts; what is newer in other lists counts"
        )
    if not in_lab:
        _forget_here(lists.swarm, names)


def _forget_here(swarm: str, names: Sequence[str]) -> None:
    from swarmctl.deploy import journal

    with rollout_output.journal_warnings():
        for name in names:
            journal.forget(journal.folder(swarm), name)


def _show_forgotten(swarm: str, names: Sequence[str], *, json: bool) -> None:
    if json:
        console.print_json({"v": 1, "swarm": swarm, "forgotten": list(names)})
    else:
        console.show("\n".join(f"{name}  forgotten; whatever it has is still there" for name in names))


def _confirmed(
    swarm: str, names: Sequence[str], question: str = "Remove swarm {swarm} from {hosts}?"
) -> bool:
    """Ask for confirmation on a terminal; False without one."""
    import sys

    if not (sys.stdin.isatty() and console.err().is_terminal):
        return False
    from swarmctl.yamltext import hostlist

    text = question.format(swarm=swarm, hosts=hostlist.written(names)) + " (yes)"
    return str(typer.prompt(text, default="no", err=True)) == "yes"
