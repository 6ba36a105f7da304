"""Looks at a swarm's hosts and diagnoses it, for the verbs that show its health."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from swarmctl.cli import console, selected
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Answer

    from swarmctl.health.expected_graph import ExpectedGraph
    from swarmctl.health.name_conflicts import Launched
    from swarmctl.health.swarm_health import Look, Status
    from swarmctl.remote.transport import HostError, Target, Transport
    from swarmctl.spec.load import Document
    from swarmctl.swarm.index import SwarmIndex
    from swarmctl.swarm.resolved import Swarm

Looking = Callable[[], "Look"]


@dataclass(frozen=True)
class Expected:
    """A swarm and what is expected of its hosts."""

    document: Document
    swarm: Swarm
    graph: ExpectedGraph

    @cached_property
    def index(self) -> SwarmIndex:
        """Lookups in the document."""
        from swarmctl.swarm.index import SwarmIndex

        return SwarmIndex(self.document)

    @cached_property
    def _launched(self) -> Launched:
        from swarmctl.linter.launch_uses import launch_uses, nodes_of

        return nodes_of(launch_uses(self.index))

    def status(self, outcomes: Mapping[str, Answer | HostError]) -> Status:
        """The health of the swarm, from what the probes of its hosts have found."""
        from swarmctl.health import swarm_health as health
        from swarmctl.health.diagnosis import diagnose

        return health.status(self.graph, outcomes, diagnose(self.graph, outcomes, self._launched))


def expected(where: Where) -> Expected:
    """What is expected of the hosts of a spec, of all or of the selected ones."""
    from swarmctl.health.expected_graph import Release, expected_graph
    from swarmctl.render.build_bundle import bundles

    document = console.read_document(where.spec)
    swarm = where.swarm(document)
    wanted = bundles(swarm)
    releases = {
        name: Release(
            wanted[name].digest, tuple(unit.name for unit in wanted[name].units), tuple(wanted[name].requires)
        )
        for name in selected.hosts(swarm.candidates, where.limit)
        if wanted[name].files
    }
    return Expected(document, swarm, expected_graph(swarm, releases))


def looking(where: Where, transport: Transport, window: float) -> Looking:
    """A function that observes all hosts and diagnoses the swarm."""
    wanted = expected(where)
    targets = where.targets(wanted.swarm)
    return looking_at(wanted, targets, transport, window=window, parallel=where.parallel)


def looking_at(
    wanted: Expected, targets: Mapping[str, Target], transport: Transport, *, window: float, parallel: int
) -> Looking:
    """The same, for hosts that are known already."""
    from swarmctl.health.collect import probe_hosts
    from swarmctl.health.swarm_health import Look

    def look() -> Look:
        began, clock = time.time(), time.monotonic()
        outcomes = probe_hosts(wanted.graph, targets, transport, window=window, parallel=parallel)
        return Look(wanted.status(outcomes), began, time.monotonic() - clock)

    return look
