"""Starts a trial on hosts at one instant: each waits for it by its own clock."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from swarm_onboard.agent.verbs import trial

from swarmctl.remote import operators
from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import Target, Transport

_TIMEOUT = 60.0  # s, more than a host waits for the instant


def seen(
    swarm: str, targets: Mapping[str, Target], transport: Transport, parallel: int
) -> Iterator[Event[trial.Answer]]:
    """Asks hosts for their clocks, and for the robots of the trial that goes on there; starts nothing."""
    request = trial.Request(swarm, operators.this_one(), [], [], at=0.0, seconds=0.0)
    return start(dict.fromkeys(targets, request), targets, transport, parallel=parallel)


def instant(answers: Mapping[str, trial.Answer], lead: float) -> float:
    """Returns the instant ``lead`` s after the latest of the hosts' clocks, in s since 1970."""
    return max(answer.clock for answer in answers.values()) + lead


def start(
    requests: Mapping[str, trial.Request],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    parallel: int,
) -> Iterator[Event[trial.Answer]]:
    """Starts the trial on hosts, by ``requests``. One that fails before the instant releases no robot."""
    return ask_each(trial.handle, requests, targets, transport, parallel=parallel, timeout=_TIMEOUT)
