"""Asks the agents of hosts: a request and an answer are values of the verb's own module, on both sides.

A verb of a host is a module of ``swarm_onboard.agent.verbs`` with `Request` and `Answer`, named tuples, and
``handle``, which runs on the host. What a host sends is checked here, once.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from swarmctl.remote import parallel_hosts
from swarmctl.remote.agent_archive import DEPLOY_VERBS, agent
from swarmctl.remote.agent_client import agent_session
from swarmctl.remote.answer_check import checked, cut
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import AgentSession, Session, Target, Transport

if TYPE_CHECKING:
    from swarm_onboard.agent.rpc import Report

Q = TypeVar("Q", bound=tuple[Any, ...])
A = TypeVar("A", bound=tuple[Any, ...])
Handle = Callable[[Q, bytes, "Report"], A]
"""The function of a verb that runs on the host."""


def verb_of(handle: Callable[..., Any]) -> str:
    """Returns the name of a verb."""
    return handle.__module__.rpartition(".")[2]


def ask(
    host: AgentSession,
    handle: Handle[Q, A],
    request: Q,
    payload: bytes = b"",
    *,
    on_note: Callable[[str], None] | None = None,
    timeout: float = 60.0,
    longest_text: int | None = None,
) -> A:
    """Returns the answer of ``host``. Raises ``HostError``, as ``AgentSession.request`` does.

    ``longest_text``: characters after which each text of the answer is cut.
    """
    verb = verb_of(handle)
    fields: dict[str, Any] = request._asdict()  # type: ignore[attr-defined]
    found = host.request({"verb": verb, **fields}, payload, on_note=on_note, timeout=timeout)
    kind: type[A] = sys.modules[handle.__module__].Answer
    if longest_text is not None:
        found = cut(found, longest_text)
    return checked(found, kind, f"the answer to `{verb}`")


def ask_each(
    handle: Handle[Q, A],
    requests: Mapping[str, Q],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    parallel: int,
    timeout: float = 60.0,
) -> Iterator[Event[A]]:
    """Asks hosts at the same time, each over a connection of its own. ``requests``: by host.

    Yields events as they happen; every host ends in an answer or an error.
    """
    verb = verb_of(handle)
    verbs = DEPLOY_VERBS if verb in DEPLOY_VERBS else (verb,)  # hosts keep the agent of the last deploy
    # The archive of the agent is made while the connections are.
    threading.Thread(target=agent, args=(verbs,), daemon=True).start()

    def work(session: Session, target: Target, note: Callable[[str], None]) -> A:
        with agent_session(session, verbs=verbs) as host:
            return ask(host, handle, requests[target.host], on_note=note, timeout=timeout)

    return parallel_hosts.run(
        (targets[one] for one in requests), work, transport=transport, parallel=parallel
    )
