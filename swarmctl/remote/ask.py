"""Asks the agents of hosts: a request and an answer are values of the verb's own module, on both sides.

A verb of a host is a module of ``swarm_onboard.agent.verbs`` with `Request` and `Answer`, named tuples, and
``handle``, which runs on the host. What a host sends is checked here, once.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from swarmctl.remote import parallel_hosts
from swarmctl.remote.agent_archive import DEPLOY_VERBS, agent
from swarmctl.remote.agent_client import agent_session, printable
from swarmctl.remote.answer_check import parsed
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import AgentSession, HostError, Kind, Session, Target, Transport

if TYPE_CHECKING:
    from pydantic import TypeAdapter
    from swarm_onboard.agent.rpc import Report

Q = TypeVar("Q", bound=tuple[Any, ...])
A = TypeVar("A", bound=tuple[Any, ...])
Handle = Callable[[Q, bytes, "Report"], A]
"""The function of a verb that runs on the host."""

_LONGEST_COMPLAINT = 300  # characters


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
) -> A:
    """Returns the answer of ``host``. Raises ``HostError``, as ``AgentSession.request`` does."""
    verb = verb_of(handle)
    fields: dict[str, Any] = request._asdict()  # type: ignore[attr-defined]
    found = host.request({"verb": verb, **fields}, payload, on_note=on_note, timeout=timeout)
    kind: type[A] = sys.modules[handle.__module__].Answer
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


def of_note(text: str, kind: type[A], what: str) -> A:
    """Returns the value of a note, the JSON of a ``kind``. Raises ``HostError``."""
    try:
        found = parsed(text)
    except ValueError:
        raise HostError(Kind.PROTOCOL, f"{what} cannot be read") from None
    return checked(found, kind, what)


def checked(found: Any, kind: type[A], what: str) -> A:
    """Returns JSON from a host, called ``what``, as a ``kind``. Raises ``HostError`` if it is none."""
    from pydantic import ValidationError  # noqa: PLC0415  (takes long to load; `stop` sends its request first)

    try:
        value: A = _adapter(kind).validate_python(found)
        return value
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        place = ".".join(str(one)[:80] for one in first["loc"])
        problem = f"{place}: {first['msg']}" if place else first["msg"]
    raise HostError(
        Kind.PROTOCOL,
        f"{what} does not fit: {printable(problem.encode(errors='replace'))[:_LONGEST_COMPLAINT]}",
        "is it the right host, and its Python intact?",
    )


@lru_cache
def _adapter(kind: type[A]) -> TypeAdapter[A]:
    from pydantic import TypeAdapter  # noqa: PLC0415

    # Modules of the agent do not import `typing` on a host, where loading it takes long.
    for name, module in list(sys.modules.items()):
        if name.startswith("swarm_onboard."):
            vars(module).update({"Any": Any, "Literal": Literal} | vars(module))
    return TypeAdapter(kind, config={"strict": True, "allow_inf_nan": False})
