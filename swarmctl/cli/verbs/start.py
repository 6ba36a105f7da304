"""``swarmctl start``: releases robots that ``swarmctl stop`` has stopped."""

from __future__ import annotations

import typer

from swarmctl.cli import console, exit_codes, next_command, options, stop_targets
from swarmctl.cli.verbs.stop import Robots


def start(
    spec: options.Spec,
    robots: Robots = None,
    overlays: options.Overlays = None,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    parallel: options.Parallel = options.PARALLEL_URGENT,
    json: options.Json = False,
) -> None:
    """Release robots that `swarmctl stop` has stopped; each stands until its next command."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy import robot_stop
    from swarmctl.remote.parallel_hosts import results_of
    from swarmctl.remote.transport import HostError
    from swarmctl.views.escape import printable

    reach = stop_targets.read(spec)
    chosen, without = stop_targets.by_host(reach, robots)
    targets = options.targets(spec, reach, lab=lab, lab_name=lab_name)
    results = results_of(
        robot_stop.start(reach.name, chosen, targets, transport(), others=not robots, parallel=parallel)
    )
    errors = {host: one for host, one in results.items() if isinstance(one, HostError)}
    released = [name for one in results.values() if not isinstance(one, HostError) for name in one.released]
    if json:
        failed = [{"host": host, **one.to_json()} for host, one in errors.items()]
        console.print_json({"v": 1, "swarm": reach.name, "released": sorted(released), "errors": failed})
    else:
        for name in sorted(released):
            console.show(f"{name}  released: it stands until its next command")
        for host, one in errors.items():
            console.show(f"{host}  {one.kind.value}: {printable(one.message)}")
        for name in without:
            console.show(f"{name}  failed: the spec has no host with an address for it")
        if not released and not errors:
            console.show("no robot was stopped")
        next_command.advise("status", spec, *next_command.where(lab=lab, lab_name=lab_name))
    stop_targets.warn_of_errors(spec)
    if without or any(one.reached for one in errors.values()):
        raise typer.Exit(exit_codes.HOSTS_FAILED)
    raise typer.Exit(exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK)
