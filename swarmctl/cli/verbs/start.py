"""``swarmctl start``: releases robots that ``swarmctl stop`` has stopped."""

from __future__ import annotations

import typer

from swarmctl.cli import console, exit_codes, options, stop_targets
from swarmctl.cli.verbs.stop import Robots
from swarmctl.cli.where import Where, with_where


@with_where("parallel", parallel=options.PARALLEL_URGENT)
def start(
    where: Where,
    robots: Robots = None,
    json: options.Json = False,
) -> None:
    """Release robots that `swarmctl stop` has stopped; each stands until its next command."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy import robot_stop
    from swarmctl.remote.parallel_hosts import results_of
    from swarmctl.remote.transport import HostError
    from swarmctl.views.escape import printable

    reach = stop_targets.read(where.spec)
    chosen, without = stop_targets.by_host(reach, robots)
    targets = where.targets(reach)
    results = results_of(
        robot_stop.start(reach.name, chosen, targets, transport(), others=not robots, parallel=where.parallel)
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
        where.advise("status")
    stop_targets.warn_of_errors(where.spec)
    if without or any(one.reached for one in errors.values()):
        raise typer.Exit(exit_codes.HOSTS_FAILED)
    raise typer.Exit(exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK)
