"""``swarmctl restart``: restarts the units of robots."""

from __future__ import annotations

import typer

from swarmctl.cli import console, exit_codes, options, stop_targets
from swarmctl.cli.verbs.stop import Robots
from swarmctl.cli.where import Where, with_where


@with_where("parallel", parallel=options.PARALLEL_URGENT)
def restart(
    where: Where,
    robots: Robots = None,
    stop_robots: options.StopRobots = False,
    json: options.Json = False,
) -> None:
    """Restart the drivers and other units of robots. One that moves or is under command is not touched."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy import robot_stop
    from swarmctl.remote.parallel_hosts import results_of
    from swarmctl.remote.transport import HostError
    from swarmctl.views.escape import printable

    reach = stop_targets.read(where.spec)
    chosen, without = stop_targets.by_host(reach, robots)
    targets = where.targets(reach)
    events = robot_stop.restart(
        reach.name, chosen, targets, transport(),
        others=not robots, stop_robots=stop_robots, parallel=where.parallel,
    )  # fmt: skip
    results = results_of(events)
    errors = {host: one for host, one in results.items() if isinstance(one, HostError)}
    done = {host: one.restarted for host, one in results.items() if not isinstance(one, HostError)}
    missing = [host for host, units in done.items() if not units and robots]
    if json:
        failed = [{"host": host, **one.to_json()} for host, one in errors.items()]
        console.print_json({"v": 1, "swarm": reach.name, "restarted": done, "errors": failed})
    else:
        for host, units in done.items():
            console.show(f"{host}  restarted {', '.join(units)}" if units else f"{host}  nothing to restart")
        for host, one in errors.items():
            console.show(f"{host}  {one.kind.value}: {printable(one.message)}")
            if one.hint:
                console.show(f"  help: {printable(one.hint)}")
        for name in without:
            console.show(f"{name}  failed: the spec has no host with an address for it")
        where.advise("status")
    stop_targets.warn_of_errors(where.spec)
    if without or missing or any(one.reached for one in errors.values()):
        raise typer.Exit(exit_codes.HOSTS_FAILED)
    raise typer.Exit(exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK)
