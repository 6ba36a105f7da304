"""Observes one host: what it runs, and how that differs from what was deployed."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from swarm_onboard.agent.verbs import observe

from swarmctl.adoption.changes import EditedFile
from swarmctl.plan.observed_host import Observed, edited_files, from_answer
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.answer_check import checked
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import AgentSession, HostError, Session, Target, Transport
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


def edits_on_hosts(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    parallel: int,
) -> dict[str, list[EditedFile] | HostError]:
    """Returns by host the edits that ``bundles`` would replace, or why the host did not say."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> list[EditedFile]:
        with agent_client.agent_session(session) as host:
            return edited_files(bundles[target.host], observe_host(host, bundles[target.host]))

    chosen = [targets[name] for name in bundles]
    events = parallel_hosts.run(chosen, work, transport=transport, parallel=parallel)
    found = parallel_hosts.results_of(events)
    return {name: found[name] for name in bundles}
