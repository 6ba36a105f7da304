"""Observes one host: what it runs, and how that differs from what was deployed."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from swarm_onboard.agent.messages import ObserveRequest

from swarmctl.plan.observed_host import Observed, from_answer
from swarmctl.remote.transport import AgentSession
from swarmctl.render.bundle import Bundle

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
    request: ObserveRequest = {
        "verb": "observe",
        "swarm": bundle.swarm,
        "known_release": bundle.digest,
        "contents": contents,
        "motion": motion,
        "stop_robots": stop_robots,
    }
    if bundle.asks:
        request["requires"] = list(bundle.asks)
    if bundle.wants:
        request["wants"] = list(bundle.wants)
    if bundle.wireguard_keys:
        request["wireguard_keys"] = bundle.wireguard_keys
    offered = b""
    if bundle.secrets:
        request["secrets"] = list(bundle.secrets)
        offered = offer(bundle.secrets, secrets)
    return from_answer(host.request(request, offered), bundle, received=time.time())


def offer(names: Iterable[str], secrets: Mapping[str, str]) -> bytes:
    """Returns the values of those of the secrets that the operator has, as the agent reads them."""
    return json.dumps({name: secrets[name] for name in names if name in secrets}).encode()
