"""``swarmctl remove``: remove the swarm from its hosts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, left_hosts, options, rollout_output, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.deploy.host_lists import HostLists, LeftHost
    from swarmctl.remote.transport import Target


@with_where("limit", "parallel", "executor", "no_reuse")
def remove(
    where: Where,
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
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Remove the swarm from its hosts: stop the robots; remove units, links and /opt/swarm/<name>."""
    from swarmctl.cli.ssh_targets import read_known_hosts
    from swarmctl.deploy import rollout
    from swarmctl.deploy.outcome import Removed
    from swarmctl.plan.robots_in_use import Dependents
    from swarmctl.remote.parallel_hosts import interruptible

    swarm = console.read_spec(where.spec)
    if forget and not (orphans and where.limit):
        console.fail(
            "--forget needs --orphans and --limit with the names of the hosts", code=exit_codes.USAGE
        )
    lists = left_hosts.lists_of(swarm)
    targets = where.targets(swarm)
    if orphans:
        _read_lists(lists, targets, where)
    found_left = left_hosts.left_hosts(swarm, lists, in_lab=where.in_lab) if orphans else ({}, [])
    if forget:
        names = left_hosts.chosen([*found_left[0], *found_left[1]], where.limit)
        if not yes and not _confirmed(
            swarm.name, names, "Forget {swarm} on {hosts}, which keep what runs there?"
        ):
            console.fail("nothing was forgotten", "answer `yes`, or use --yes in scripts")
        _forget(lists, names, targets, where, logged=True)
        _show_forgotten(swarm.name, names, json=json)
        raise typer.Exit(exit_codes.OK)
    left: dict[str, LeftHost] = {}
    if orphans:
        known = None if where.in_lab else read_known_hosts(where.spec.first)
        left = left_hosts.to_contact(swarm, found_left, where.limit, known, yes=yes)
        targets = where.targets(left_hosts.with_left(swarm, left))
    names = list(left) or selected.hosts(swarm.candidates, where.limit)
    if not yes and not _confirmed(swarm.name, names):
        console.fail("nothing was removed", "answer `yes`, or use --yes in scripts")
    with where.transport() as transport, interruptible(rollout_output.note) as stop:
        events = rollout.remove(
            names, targets, transport,
            dependents=Dependents(swarm), parallel=where.parallel, stop=stop, stop_robots=stop_robots,
        )  # fmt: skip
        found = rollout_output.results(events, names, quiet=json)
    if json:
        console.print_json(rollout_output.document(swarm.name, found))
    else:
        rollout_output.report(
            swarm, found, where.complete,
            details=details, interrupted=stop.requested,
        )  # fmt: skip
    if not where.in_lab:
        where.guess_lab("remove", swarm.name, rollout_output.errors(found))
    gone = [name for name, result in found.items() if isinstance(result, Removed)]
    if orphans and gone:
        _forget(lists, gone, targets, where)
    elif not where.in_lab:
        _forget_here(swarm.name, gone)
    code = rollout_output.exit_code(found, interrupted=stop.requested)
    if not json and code not in (exit_codes.OK, exit_codes.INTERRUPTED):
        rollout_output.advise_again("remove", where, found)
    raise typer.Exit(code)


def _read_lists(lists: HostLists, targets: Mapping[str, Target], where: Where) -> None:
    """Reads which hosts the hosts of the spec name."""
    from swarmctl.deploy.host_list_updates import read_all
    from swarmctl.views.escape import printable

    errors = read_all(lists, targets.values(), where.transport, where.parallel)
    for host, error in errors.items():
        console.err().print(
            f"warning: the list of hosts of {host} is not known ({error.kind.value}: {printable(str(error))})"
        )


def _forget(
    lists: HostLists,
    names: Sequence[str],
    targets: Mapping[str, Target],
    where: Where,
    *,
    logged: bool = False,
) -> None:
    """Removes hosts from the lists of the others and from the journal; ``logged``: in the history, too."""
    from swarmctl.deploy.host_list_updates import write_all_anew

    wanted = lists.wanted((), lists.spec, names)
    hosts = lists.hosts if logged else lists.outdated(lists.hosts, wanted)
    errors = write_all_anew(
        lists, wanted, [targets[host] for host in hosts],
        where.transport,
        forgotten=names if logged else (), parallel=where.parallel,
    )  # fmt: skip
    for host in errors:
        console.err().print(
            f"warning: {host} did not take the new list of hosts; what is newer in other lists counts"
        )
    if not where.in_lab:
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
