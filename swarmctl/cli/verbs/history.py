"""``swarmctl history``: the runs that changed the swarm, from the logs of its hosts; who drove its robots."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, options, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path
    from typing import TypeVar

    from swarmctl.deploy.host_records import HostRecords
    from swarmctl.remote.parallel_hosts import Event
    from swarmctl.remote.transport import HostError, Target

    _Result = TypeVar("_Result")

Commands = Annotated[
    bool,
    typer.Option("--commands", help="List who commanded which robot, and check the hosts' records of it."),
]


@with_where("limit", "parallel")
def history(
    where: Where,
    commands: Commands = False,
    json: options.Json = False,
) -> None:
    """List the runs that changed the hosts, or who commanded their robots.

    From the logs of the hosts: when, who, which releases, with what result; with --commands also who
    commanded which robot, from when to when.
    """
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy.host_records import histories
    from swarmctl.plan.history import runs
    from swarmctl.views.history import history_text

    swarm = console.read_spec(where.spec)
    names = selected.hosts(swarm.candidates, where.limit)
    targets = where.targets(swarm)
    chosen = [targets[name] for name in names]
    if commands:
        _print_commands(swarm.name, chosen, parallel=where.parallel, in_lab=where.in_lab, json=json)
    found, errors = _results(names, histories(swarm.name, chosen, transport(), parallel=where.parallel))
    listed = runs({name: one.entries for name, one in found.items()})
    if json:
        hosts = {name: one.to_json() for name, one in errors.items()}
        document = {"v": 1, "swarm": swarm.name, "runs": [run.to_json() for run in listed], "errors": hosts}
        console.print_json(document)
    else:
        console.out().print(history_text(listed, errors, console.columns()))
        if listed:
            where.advise("rollback", "--dry-run")
    raise typer.Exit(_code(errors))


def _results(
    names: Sequence[str], events: Iterable[Event[_Result]]
) -> tuple[dict[str, _Result], dict[str, HostError]]:
    """What each host answered, and the errors of the others."""
    from swarmctl.remote.parallel_hosts import results_of
    from swarmctl.remote.transport import HostError

    ended = results_of(events)
    in_order = {name: ended[name] for name in names}
    errors = {name: one for name, one in in_order.items() if isinstance(one, HostError)}
    return {name: one for name, one in in_order.items() if not isinstance(one, HostError)}, errors


def _code(errors: Mapping[str, HostError]) -> int:
    failed = any(error.reached for error in errors.values())
    unreached = exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK
    return exit_codes.HOSTS_FAILED if failed else unreached


def _print_commands(
    swarm: str, targets: Sequence[Target], *, parallel: int, in_lab: bool, json: bool
) -> None:
    """Prints who commanded the robots, and ends the program."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy import host_records, journal
    from swarmctl.deploy.host_records import command_records
    from swarmctl.plan.command_history import events
    from swarmctl.plan.history import runs
    from swarmctl.views.history import command_table

    names = [target.host for target in targets]
    place = journal.folder(swarm)
    # A lab may be booted anew, and its robots with it.
    seen = {name: {} if in_lab else host_records.recall_heads(place, name) for name in names}
    read = command_records(swarm, list(targets), transport(), seen, parallel=parallel)
    found, errors = _results(names, read)
    records = {(host, robot): one for host, all_ in found.items() for robot, one in all_.robots.items()}
    listed, changes = events(records), runs({host: one.changes for host, one in found.items()})
    if json:
        console.print_json({
            "v": 1, "swarm": swarm, "commands": [one.to_json() for one in listed],
            "runs": [run.to_json() for run in changes],
            "records": [
                {"host": host, "robot": name, **one.to_json()} for (host, name), one in records.items()
            ],
            "errors": {name: one.to_json() for name, one in errors.items()},
        })  # fmt: skip
    else:
        console.out().print(command_table(listed, changes, records, errors))
    if not in_lab:
        try:
            _remember(place, found)
        except OSError as error:
            console.fail(console.cannot_write(error, place))
    broken = any(one.problem for one in records.values())
    raise typer.Exit(exit_codes.HOSTS_FAILED if broken else _code(errors))


def _remember(place: Path, found: Mapping[str, HostRecords]) -> None:
    """Stores the heads that were read; those of records with a problem stay as they were."""
    from swarmctl.deploy import host_records

    for host, one in found.items():
        sound = {robot: record.head for robot, record in one.robots.items() if not record.problem}
        host_records.remember_heads(place, host, {**host_records.recall_heads(place, host), **sound})
