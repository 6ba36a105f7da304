"""Probes all hosts in parallel, over one connection each; one host's failure does not affect the others."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from swarm_onboard.agent.verbs import probe
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.expected_graph import ExpectedGraph
from swarmctl.health.host_checks import host_checks
from swarmctl.health.probe_request import LONGEST_LISTENING, request
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.answer_check import checked
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import AgentSession, HostError, Session, Target, Transport

WINDOW = 2.0  # s of listening to a topic, unless it is slow
_AROUND = 40.0  # s, more than the sum of the agent's own time limits before and after listening
_LONGEST_TEXT = 300  # characters


def probe_hosts(
    graph: ExpectedGraph,
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    window: float = WINDOW,
    parallel: int,
) -> dict[str, Answer | HostError]:
    """The answer of every host of ``graph``, or the error.

    ``window``: how long to listen to each topic, s.
    """
    requests = {host.name: request(graph, host, window) for host in graph.hosts}
    probes = {host.name: host.probe for host in graph.hosts}
    patience = max(window, LONGEST_LISTENING) + _AROUND

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Answer:
        with agent_client.agent_session(session, verbs=("probe",), module=probes[target.host]) as host:
            return probed(host, requests[target.host], patience)

    chosen = [targets[name] for name in requests]
    return parallel_hosts.results_of(parallel_hosts.run(chosen, work, transport=transport, parallel=parallel))


def probed(host: AgentSession, request: probe.Request, timeout: float) -> Answer:
    """Returns what a host has seen. Raises ``HostError``."""
    answer = ask(host, probe.handle, request, timeout=timeout, longest_text=_LONGEST_TEXT)
    ahead = None if answer.time is None else answer.time - time.time()
    return answer._replace(clock_ahead=ahead, checks=checks_of(answer))


def checks_of(answer: Answer) -> dict[str, list[Any]]:
    """Returns what was observed for each check of a host, by name, as values of the check's type.

    Raises ``HostError`` if a check reports what it cannot.
    """
    return {
        name: [
            checked(one, host_checks()[name].Seen, f"what the host observed for `{name}`") for one in found
        ]
        for name, found in answer.checks.items()
        if name in host_checks()
    }
