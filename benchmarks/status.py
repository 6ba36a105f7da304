"""What `swarmctl status` costs: ``python benchmarks/status.py [--hosts N] [--rounds N] [--check]``.

As root, in a lab of N deployed hosts: the look at all hosts, from the first connection to the last answer,
beside bare paramiko that logs in to them and runs ``true``, and beside the probes alone, sent to agents that
run already. What the look takes beyond its probes is what swarmctl is responsible for, and has a bar.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from deploy import await_rest, deployed, log_in_everywhere, spec_of
from deploy_cost.profile import start_agent
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health import collect
from swarmctl.health.collect import request
from swarmctl.health.expected_graph import ExpectedGraph, Release, expected_graph
from swarmctl.lab import paths
from swarmctl.remote import agent_client
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import Target
from swarmctl.render.bundle import Bundle
from tests.loading import load_swarm

BAR = 1.5  # times the bare login


def graph_of(spec: Path, bundles: Mapping[str, Bundle]) -> ExpectedGraph:
    swarm, _ = load_swarm(spec)
    assert swarm is not None
    names = {
        host: Release(one.digest, tuple(unit.name for unit in one.units)) for host, one in bundles.items()
    }
    return expected_graph(swarm, names)


def looked(graph: ExpectedGraph, reach: Mapping[str, Target]) -> None:
    """Asks all hosts as the verb does. Raises SystemExit if one does not answer."""
    found = collect.probe_hosts(graph, reach, SshTransport(), parallel=len(reach))
    if wrong := {host: str(one) for host, one in found.items() if not isinstance(one, Answer)}:
        raise SystemExit(str(wrong))


def probed(graph: ExpectedGraph, reach: Mapping[str, Target]) -> float:
    """Returns the s that the probes of all hosts take over conversations whose agents run already."""
    with ExitStack() as until_done, ThreadPoolExecutor(len(reach)) as pool:
        talks = {}
        for host in graph.hosts:
            session = until_done.enter_context(SshTransport().connect(reach[host.name]))
            talk = agent_client.agent_session(session, verbs=("probe",), module=host.probe)
            talks[host.name] = until_done.enter_context(talk)
        list(pool.map(start_agent, talks.values()))
        questions = {host.name: request(graph, host, collect.WINDOW) for host in graph.hosts}
        return seconds(lambda: list(pool.map(lambda name: talks[name].request(questions[name]), talks)))


def seconds(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def rounds_of(spec: Path, rounds: int) -> list[tuple[float, float, float]]:
    """The s of the bare login, of the probes alone, and of the whole look, round by round."""
    with deployed(spec) as (targets, wanted):
        reach = {target.host: target for target in targets}
        graph = graph_of(spec, wanted)
        found = []
        for _ in range(rounds + 1):
            await_rest()
            login, own = seconds(lambda: log_in_everywhere(targets)), probed(graph, reach)
            found.append((login, own, seconds(lambda: looked(graph, reach))))
        return found[1:]  # the first warms up


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hosts", type=int, default=5)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--check", action="store_true", help="fail above the bar")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="swarm-bench-") as folder:
        os.environ.setdefault(paths.STATE_VARIABLE, folder)
        spec = Path(folder, "swarm.yaml")
        spec.write_text(spec_of(given.hosts))
        found = rounds_of(spec, given.rounds)
    bare, probes, whole = (statistics.median(one) for one in zip(*found, strict=True))
    ratio = statistics.median((all_ - own) / login for login, own, all_ in found)
    print(f"{given.hosts} hosts, {given.rounds} rounds, median")
    print(f"  bare paramiko: connect, true  {bare:6.2f} s")
    print(f"  the probes alone              {probes:6.2f} s, of which {collect.WINDOW:g} s listen to topics")
    print(f"  the whole look                {whole:6.2f} s")
    print(f"  beyond the probes: {ratio:.2f} x bare, bar {BAR}")
    return int(given.check and ratio > BAR)


if __name__ == "__main__":
    sys.exit(main())
