"""Probes all hosts in parallel, over one connection each; one host's failure does not affect the others."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from swarmctl.health.expected_graph import ExpectedGraph
from swarmctl.health.observations import Answer
from swarmctl.health.probe_answer import answer_of
from swarmctl.health.probe_request import LONGEST_LISTENING, request
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.transport import HostError, Session, Target, Transport

WINDOW = 2.0  # s of listening to a topic, unless it is slow
_AROUND = 40.0  # s, more than the sum of the agent's own time limits before and after listening


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
            data = host.request(requests[target.host], timeout=patience)
            return answer_of(data, received=time.time())

    chosen = [targets[name] for name in requests]
    outcomes: dict[str, Answer | HostError] = {}
    for event in parallel_hosts.run(chosen, work, transport=transport, parallel=parallel):
        if isinstance(event, parallel_hosts.Finished | parallel_hosts.Skipped):
            outcome = parallel_hosts.result_of(event)
            outcomes[event.host] = outcome
    return outcomes
