"""Carries plans out: all hosts at once, each looked at, planned and changed on one connection."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from swarmctl.plan.observed import Observed, from_answer
from swarmctl.plan.plan import HostPlan, Kind, Plan, Problem
from swarmctl.plan.reconcile import reconcile
from swarmctl.remote import agent, fleet
from swarmctl.remote.transport import HostError, Session, Target, Transport
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.render.bundle import Bundle

_NO_SECRETS: Mapping[str, str] = MappingProxyType({})
APPLY_TIMEOUT = 300.0  # s; the agent's own steps are bounded, and this is above their sum


@dataclass(frozen=True)
class Outcome:
    """What became of one host: the plan that was carried out, and its units after it."""

    plan: HostPlan
    units: Mapping[str, Any] = field(default_factory=dict)

    @property
    def changed(self) -> bool:
        return bool(self.plan.steps)


@dataclass(frozen=True)
class Removed:
    """What became of a host that the swarm was taken off: whether there was anything to take."""

    changed: bool


Result = Outcome | Removed | HostError


def observe(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    diff: bool = False,
    parallel: int = fleet.PARALLEL,
    secrets: Mapping[str, str] = _NO_SECRETS,
) -> Plan:
    """Look at every host and plan it; a host that does not answer keeps its place, with the reason."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> HostPlan:
        bundle = bundles[target.host]
        with agent.talk(session) as host:
            return reconcile(bundle, look(host, bundle, contents=diff, secrets=secrets), diff=diff)

    plans = {
        event.host: _planned(bundles[event.host], fleet.result_of(event))
        for event in fleet.run(_chosen(targets, bundles), work, transport=transport, parallel=parallel)
        if isinstance(event, fleet.Finished | fleet.Skipped)
    }
    swarm = next(iter(bundles.values())).swarm
    return Plan(swarm, tuple(plans[name] for name in bundles))


def deploy(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    parallel: int = fleet.PARALLEL,
    stop: fleet.Stop | None = None,
    secrets: Mapping[str, str] = _NO_SECRETS,
) -> Iterator[fleet.Event[Outcome]]:
    """Bring every host to its bundle. One connection a host; a host that dies costs that host only."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Outcome:
        bundle = bundles[target.host]
        with agent.talk(session) as host:
            plan = reconcile(bundle, look(host, bundle, secrets=secrets))
            if plan.problem:
                raise HostError(ErrorKind.REFUSED, plan.problem.message, plan.problem.hint)
            if not plan.steps:
                return Outcome(plan)
            if due := plan.targets(Kind.SECRET):
                request = {"verb": "keep", "swarm": bundle.swarm, "who": agent.operator()}
                host.ask(request, _offer(due, secrets))
            return Outcome(plan, apply(host, plan, bundle, note)["units"])

    return fleet.run(_chosen(targets, bundles), work, transport=transport, parallel=parallel, stop=stop)


def remove(
    swarm: str,
    targets: Iterable[Target],
    transport: Transport,
    *,
    parallel: int = fleet.PARALLEL,
    stop: fleet.Stop | None = None,
) -> Iterator[fleet.Event[Removed]]:
    """Take the swarm off every target: robots stopped, units, links and folder gone."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Removed:
        request = {"verb": "remove", "swarm": swarm, "who": agent.operator()}
        with agent.talk(session) as host:
            return Removed(host.ask(request, on_note=note, timeout=APPLY_TIMEOUT)["removed"])

    return fleet.run(targets, work, transport=transport, parallel=parallel, stop=stop)


def look(
    host: agent.Conversation,
    bundle: Bundle,
    *,
    contents: bool = False,
    secrets: Mapping[str, str] = _NO_SECRETS,
) -> Observed:
    """Ask the host what it runs. It compares ``secrets`` itself: a digest of four digits hides nothing."""
    request = {"verb": "observe", "swarm": bundle.swarm, "know": bundle.digest, "contents": contents}
    if bundle.asks:
        request["requires"] = bundle.asks
    if bundle.wants:
        request["wants"] = bundle.wants
    offered = b""
    if bundle.secrets:
        request["secrets"] = bundle.secrets
        offered = _offer(bundle.secrets, secrets)
    return from_answer(host.ask(request, offered), bundle)


def _offer(names: Iterable[str], secrets: Mapping[str, str]) -> bytes:
    return json.dumps({name: secrets[name] for name in names if name in secrets}).encode()


def apply(
    host: agent.Conversation, plan: HostPlan, bundle: Bundle, note: Callable[[str], None]
) -> dict[str, Any]:
    """Let the host's agent carry the plan out: old release or new, nothing between."""
    request = {
        "verb": "apply",
        "swarm": bundle.swarm,
        "txid": agent.new_txid(),
        "who": agent.operator(),
        "base": plan.base,
        "next": plan.next,
        "stop": plan.targets(Kind.STOP),
        "start": plan.targets(Kind.START),
        "restart": plan.targets(Kind.RESTART),
        "reload": plan.targets(Kind.RELOAD),
    }
    payload = agent.pack(
        bundle.manifest_bytes, {file.path: (file.content, file.mode) for file in bundle.files}
    )
    return host.ask(request, payload, on_note=note, timeout=APPLY_TIMEOUT)


def _chosen(targets: Mapping[str, Target], bundles: Mapping[str, Bundle]) -> list[Target]:
    return [targets[name] for name in bundles]


def _planned(bundle: Bundle, result: HostPlan | HostError) -> HostPlan:
    if isinstance(result, HostPlan):
        return result
    problem = Problem(result.kind.value, result.message, result.hint)
    return HostPlan(bundle.host, None, bundle.digest, problem=problem)
