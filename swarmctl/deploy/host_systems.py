"""The system of each host: its distribution, its ROS and its Python, as the host itself knows them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from swarm_onboard.agent.verbs import observe

from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import results_of
from swarmctl.remote.transport import HostError, Target, Transport


class System(NamedTuple):
    """``platform``: as in ``platforms.platform``; ``python``: the version."""

    platform: str
    python: str


def systems(
    swarm: str,
    releases: Mapping[str, str],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    parallel: int,
) -> dict[str, System]:
    """Returns the system of each host that answers. ``releases``: by host, the one that it has."""
    requests = {host: observe.Request(swarm, known_release=releases.get(host, "")) for host in targets}
    found = results_of(ask_each(observe.handle, requests, targets, transport, parallel=parallel))
    answers = {host: one.facts for host, one in found.items() if not isinstance(one, HostError)}
    return {host: System(facts.platform, facts.python) for host, facts in answers.items()}
