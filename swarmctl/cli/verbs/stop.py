"""``swarmctl stop``, ``start`` and ``restart``: robots stopped at once, released, or started again."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes, next_command, options, stop_targets
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.deploy.robot_stop import RobotStop


Robots = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="ROBOT", help="Only these robots: rover-*, @group, !rover-3.", autocompletion=complete.robots
    ),
]


@with_where("parallel", parallel=options.PARALLEL_URGENT)
def stop(
    where: Where,
    robots: Robots = None,
    json: options.Json = False,
) -> None:
    """Stop robots at once, and keep them stopped until `swarmctl start`.

    Prints for each robot when its wheels stood; the spec may have errors. The stop outlives restarts, reboots
    and deploys. Exit code 6 if a robot was sent its stop but is not confirmed to stand.
    """
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy import robot_stop
    from swarmctl.remote.parallel_hosts import Finished
    from swarmctl.remote.transport import Kind

    reach = stop_targets.read(where.spec)
    chosen, without = stop_targets.by_host(reach, robots)
    targets = where.targets(reach)
    found = [
        robot_stop.RobotStop(
            one, "", "failed", trouble="the spec has no host with an address for it", kind=Kind.REFUSED
        )
        for one in without
    ]
    events = robot_stop.stop(
        reach.name, chosen, targets, transport(urgent=True), since_start,
        others=not robots, parallel=where.parallel,
    )  # fmt: skip
    for event in events:
        from swarmctl.views import robot_stop as view  # while the connections are made

        if isinstance(event, Finished):
            results = robot_stop.robot_stops(event.host, chosen[event.host], event.outcome)
            found += results
            for one in results if not json else ():
                console.show(view.line(one))
    if json:
        console.print_json({"v": 1, "swarm": reach.name, "robots": [_entry(one) for one in found]})
    else:
        for one in found[: len(without)]:
            console.show(view.line(one))
        console.show(view.summary(found))
        next_command.advise("start", where.spec, *(robots or []), *where.options)
    stop_targets.warn_of_errors(where.spec)
    raise typer.Exit(_exit(found))


def since_start() -> float:
    """Returns the s since this process was started, which is when the key was pressed (proc(5))."""
    try:
        ticks = int(Path("/proc/self/stat").read_text("ascii", "replace").rpartition(")")[2].split()[19])
    except (OSError, ValueError, IndexError):
        return time.process_time()
    return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK"))


def _entry(one: RobotStop) -> dict[str, object]:
    return {
        "robot": one.robot,
        "host": one.host,
        "state": one.state,
        "proof": one.proof,
        "seconds": one.seconds,
        "commander": one.commander,
        "trouble": one.trouble,
    }


def _exit(found: Sequence[RobotStop]) -> int:
    from swarmctl.remote.transport import Kind

    failed = [one for one in found if one.state == "failed"]
    if any(one.kind is not Kind.UNREACHABLE for one in failed):
        return exit_codes.HOSTS_FAILED
    if failed:
        return exit_codes.HOSTS_UNREACHABLE
    return exit_codes.OK if all(one.state == "stands" for one in found) else exit_codes.NOT_PROVEN


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
