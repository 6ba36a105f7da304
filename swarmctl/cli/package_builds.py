"""What ``prepare`` does about packages that have to be built: plans the builds, and carries them out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from swarmctl.cli import console, rollout_output

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

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
    from swarmctl.deploy.build_store import store
    from swarmctl.deploy.prepare import Prepared
    from swarmctl.deploy.remote_builds import build
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
