"""Starts a trial on hosts at one instant: each waits for it by its own clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from swarm_onboard.agent.verbs import trial

from swarmctl.remote import operators, parallel_hosts
from swarmctl.remote.agent_archive import DEPLOY_VERBS
from swarmctl.remote.agent_client import agent_session
from swarmctl.remote.ask import ask, ask_each
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import Session, Target, Transport

_TIMEOUT = 60.0  # s, more than a host waits for the instant
_LOOKS = 3  # at a clock, of which the quickest counts


class Clock(NamedTuple):
    """By how much the clock of a host is ahead of this machine's, in s, and how wrong that may be.

    A host reads its clock between question and answer, which come at t0 and t1: it is ahead by its time less
    (t0 + t1)/2, within (t1 - t0)/2 (D. L. Mills, RFC 5905, section 8).
    """

    ahead: float
    error: float


class Seen(NamedTuple):
    """A host before a trial, and its clock."""

    answer: trial.Answer
    clock: Clock


def seen(
    swarm: str, targets: Mapping[str, Target], transport: Transport, parallel: int
) -> Iterator[Event[Seen]]:
    """Looks at hosts: clocks, free space, batteries and robots of the trial that goes on. Starts nothing."""
    request = trial.Request(swarm, operators.this_one(), [], [], [], at=0.0, seconds=0.0)

    def look(session: Session, target: Target, note: Callable[[str], None]) -> Seen:
        with agent_session(session, verbs=DEPLOY_VERBS) as host:
            looks = []
            for _ in range(_LOOKS):
                began = time.time()
                answer = ask(host, trial.handle, request, on_note=note, timeout=_TIMEOUT)
                ended = time.time()
                looks.append(Seen(answer, Clock(answer.clock - (began + ended) / 2, (ended - began) / 2)))
        return min(looks, key=lambda one: one.clock.error)

    return parallel_hosts.run(targets.values(), look, transport=transport, parallel=parallel)


def instant(clocks: Mapping[str, Clock], lead: float) -> float:
    """Returns the instant ``lead`` s after the latest of the hosts' clocks, in s since 1970."""
    return time.time() + max(one.ahead for one in clocks.values()) + lead


def start(
    requests: Mapping[str, trial.Request],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    parallel: int,
) -> Iterator[Event[trial.Answer]]:
    """Starts the trial on hosts, by ``requests``. One that fails before the instant releases no robot."""
    return ask_each(trial.handle, requests, targets, transport, parallel=parallel, timeout=_TIMEOUT)
