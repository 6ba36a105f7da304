"""``swarmctl history``: the runs that changed the swarm, from the logs of its hosts."""

from __future__ import annotations

import typer

from swarmctl.cli import console, exit_codes, next_command, options, selected


def history(
    spec: options.Spec,
    overlays: options.Overlays = None,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = options.PARALLEL,
    json: options.Json = False,
) -> None:
    """List the runs that changed the hosts, from their logs. When, who, which releases, with what result."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy.histories import histories
    from swarmctl.plan.history import runs
    from swarmctl.remote.parallel_hosts import Finished, Skipped, result_of
    from swarmctl.remote.transport import HostError
    from swarmctl.views.history import history_text

    swarm = console.read_spec(spec)
    names = selected.hosts(swarm.candidates, limit)
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    events = histories(swarm.name, [targets[name] for name in names], transport(), parallel=parallel)
    found = {event.host: result_of(event) for event in events if isinstance(event, Finished | Skipped)}
    found = {name: found[name] for name in names}
    errors = {name: one for name, one in found.items() if isinstance(one, HostError)}
    listed = runs({name: one for name, one in found.items() if not isinstance(one, HostError)})
    if json:
        hosts = {name: one.to_json() for name, one in errors.items()}
        document = {"v": 1, "swarm": swarm.name, "runs": [run.to_json() for run in listed], "errors": hosts}
        console.print_json(document)
    else:
        where = next_command.where(lab=lab, lab_name=lab_name, limit=limit)
        console.out().print(history_text(listed, errors, console.columns()))
        if listed:
            next_command.advise("rollback", spec, *where, "--dry-run")
    failed = any(error.reached for error in errors.values())
    unreached = exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK
    raise typer.Exit(exit_codes.HOSTS_FAILED if failed else unreached)
