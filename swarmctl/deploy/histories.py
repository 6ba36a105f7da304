"""Reads the logs of hosts: which run changed them, when, and with what result."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_onboard.agent.history_messages import ChangeEntry, HistoryAnswer, HistoryRequest
from swarm_onboard.agent.kept_state import State

from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import AgentSession, Session, Target, Transport

_VERBS = ("history",)


def history(host: AgentSession, swarm: str, to: State | None = None) -> HistoryAnswer:
    """Returns the last changes of a host, with ``to`` also the units that stop and start on the way there."""
    request: HistoryRequest = {"verb": "history", "swarm": swarm}
    if to is not None:
        request["to"] = (to.release, to.secrets)
    answer: HistoryAnswer = host.request(request)
    return answer


def histories(
    swarm: str, targets: list[Target], transport: Transport, *, parallel: int
) -> Iterator[Event[list[ChangeEntry]]]:
    """Reads the log of every host. Yields events."""

    def work(session: Session, target: Target, note: object) -> list[ChangeEntry]:
        with agent_client.agent_session(session, verbs=_VERBS) as host:
            return history(host, swarm)["entries"]

    return parallel_hosts.run(targets, work, transport=transport, parallel=parallel)
