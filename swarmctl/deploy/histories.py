"""Reads the logs of hosts: which run changed them, when, and with what result."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_onboard.agent.verbs import history

from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import Target, Transport


def histories(
    swarm: str, targets: list[Target], transport: Transport, *, parallel: int
) -> Iterator[Event[history.Answer]]:
    """Reads the log of every host. Yields events."""
    chosen = {target.host: target for target in targets}
    requests = dict.fromkeys(chosen, history.Request(swarm))
    return ask_each(history.handle, requests, chosen, transport, parallel=parallel)
