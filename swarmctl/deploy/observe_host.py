"""Observes one host: what it runs, and how that differs from what was deployed."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from swarm_onboard.agent.verbs import observe

from swarmctl.plan.observed_host import Observed, from_answer
from swarmctl.remote.answer_check import checked
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import AgentSession
from swarmctl.render.bundle import Bundle
from swarmctl.render.manifest import ManifestData

NO_SECRETS: Mapping[str, str] = MappingProxyType({})


def observe_host(
    host: AgentSession,
    bundle: Bundle,
    *,
    contents: bool = False,
    secrets: Mapping[str, str] = NO_SECRETS,
    motion: bool = False,
    stop_robots: bool = False,
) -> Observed:
    """Observe what the host runs, with ``motion`` also why its robots must not be touched now, and
    with ``stop_robots`` as far as stopping them first does not change it.
    The host compares ``secrets``: a digest of four digits hides nothing."""
    request = observe.Request(
        bundle.swarm,
        known_release=bundle.digest,
        contents=contents,
        requires=bundle.asks,
        wants=list(bundle.wants),
        secrets=bundle.secrets,
        motion=motion,
        stop_robots=stop_robots,
        wireguard_keys=bundle.wireguard_keys,
    )
    answer = ask(host, observe.handle, request, offer(bundle.secrets, secrets) if bundle.secrets else b"")
    if answer.manifest is not None:
        checked(answer.manifest, ManifestData, "the manifest of its release")
    return from_answer(answer, bundle, received=time.time())


def offer(names: Iterable[str], secrets: Mapping[str, str]) -> bytes:
    """Returns the values of those of the secrets that the operator has, as the agent reads them."""
    return json.dumps({name: secrets[name] for name in names if name in secrets}).encode()
