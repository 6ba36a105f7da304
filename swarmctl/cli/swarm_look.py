"""Looks at a swarm's hosts and diagnoses it, for the verbs that show its health."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING

from swarmctl.cli import console, exit_codes, options, selected
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    from swarmctl.health.swarm_health import Look
    from swarmctl.remote.transport import Transport

Looking = Callable[[], "Look"]


def looking(
    spec: SpecFiles,
    limit: list[str] | None,
    transport: Transport,
    *,
    lab: bool,
    lab_name: str,
    window: float,
    parallel: int,
) -> Looking:
    """A function that observes all hosts and diagnoses the swarm."""
    from swarmctl.health import swarm_health as health
    from swarmctl.health.collect import probe_hosts
    from swarmctl.health.diagnosis import diagnose
    from swarmctl.health.expected_graph import Release, expected_graph
    from swarmctl.linter.launch_uses import launch_uses, nodes_of
    from swarmctl.render.build_bundle import bundles
    from swarmctl.swarm.index import SwarmIndex

    document = console.read_document(spec)
    swarm = console.swarm_of(document, options.lab_of(document, lab, lab_name))
    wanted = bundles(swarm)
    releases = {
        name: Release(wanted[name].digest, tuple(unit.name for unit in wanted[name].units))
        for name in selected.hosts(swarm.candidates, limit)
        if wanted[name].files
    }
    graph = expected_graph(swarm, releases)
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    launched = nodes_of(launch_uses(SwarmIndex(document)))

    def look() -> Look:
        began, clock = time.time(), time.monotonic()
        outcomes = probe_hosts(graph, targets, transport, window=window, parallel=parallel)
        seen = health.status(graph, outcomes, diagnose(graph, outcomes, launched))
        return health.Look(seen, began, time.monotonic() - clock)

    return look


def need_prometheus_client(what: str) -> None:
    """Ends the program if the library is missing that ``what``, a verb or an option, needs."""
    if find_spec("prometheus_client") is None:
        console.fail(
            f"{what} needs prometheus_client, which is not installed",
            "install it: `pip install 'swarmctl[metrics]'`",
            code=exit_codes.USAGE,
        )
