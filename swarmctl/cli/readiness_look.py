"""Looks at a swarm and measures what a trial needs, at the same time."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

from swarmctl.deploy import trial_start
from swarmctl.health import readiness
from swarmctl.remote.parallel_hosts import results_of
from swarmctl.remote.transport import HostError, Target, Transport
from swarmctl.swarm.topic_island import motion_topics

if TYPE_CHECKING:
    from swarmctl.cli.swarm_look import Looking
    from swarmctl.health.swarm_health import Look
    from swarmctl.spec.experiment_model import Experiment
    from swarmctl.swarm.resolved import Swarm


def look(
    swarm: Swarm,
    experiment: Experiment,
    looking: Looking,
    targets: Mapping[str, Target],
    transport: Transport,
    parallel: int,
) -> tuple[Look, list[readiness.Item]]:
    """Returns how the swarm is, and whether a trial of ``experiment`` can begin."""
    with ThreadPoolExecutor(1) as aside:
        measuring = aside.submit(
            lambda: results_of(trial_start.seen(swarm.name, targets, transport, parallel))
        )
        before = looking()
        seen = {host: one for host, one in measuring.result().items() if not isinstance(one, HostError)}
    known = {robot: share for one in seen.values() for robot, share in one.answer.batteries.items()}
    answer = {row.name for row in before.status.hosts if row.reachable}
    robots = [one for one in experiment.robots or swarm.robots if swarm.robots[one].host in answer]
    powered = [one for one, topics in motion_topics(swarm).items() if topics.battery and one in robots]
    measured = readiness.Measured(
        {host: (one.clock.ahead, one.clock.error) for host, one in seen.items()},
        {host: one.answer.free for host, one in seen.items()},
        {robot: known.get(robot) for robot in powered},
        sorted(answer - seen.keys()),
        {one: limits.low for one in powered if (limits := swarm.robots[one].settings.battery) is not None},
    )
    return before, readiness.items(before, measured, experiment.ready, experiment.programs)
