"""Asks every host how it is, all at once, over one connection each. A host that is away costs only itself."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from swarmctl.health.answer import answer_of
from swarmctl.health.expected import ExpectedGraph
from swarmctl.health.probe import AGENT_VERBS, LONGEST_LISTENING, request
from swarmctl.health.seen import Answer
from swarmctl.remote import agent, fleet
from swarmctl.remote.transport import HostError, Session, Target, Transport

WINDOW = 2.0  # s of listening to a topic, unless it is slow
_AROUND = 40.0  # s, above the sum of what the agent allows itself before and after it listens


def ask(
    graph: ExpectedGraph,
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    window: float = WINDOW,
    parallel: int = fleet.PARALLEL,
) -> dict[str, Answer | HostError]:
    """The answer of every host of ``graph``, or why there is none."""
    questions = {host.name: request(graph, host, window) for host in graph.hosts}
    patience = max(window, LONGEST_LISTENING) + _AROUND

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Answer:
        with agent.talk(session, verbs=AGENT_VERBS) as host:
            data = host.ask(questions[target.host], timeout=patience)
            return answer_of(data, received=time.time())

    chosen = [targets[name] for name in questions]
    outcomes: dict[str, Answer | HostError] = {}
    for event in fleet.run(chosen, work, transport=transport, parallel=parallel):
        if isinstance(event, fleet.Finished | fleet.Skipped):
            outcome = fleet.result_of(event)
            outcomes[event.host] = outcome
    return outcomes
