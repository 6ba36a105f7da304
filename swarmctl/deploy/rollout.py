"""Executes plans: hosts in parallel, each observed, planned and changed on one connection."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import MappingProxyType

from swarm_agent.messages import KeepSecretsRequest, ObserveRequest, RemoveRequest, UnitState

from swarmctl.deploy.fitness import Fitness, refused
from swarmctl.deploy.host_transaction import APPLY_TIMEOUT, HostTransaction, Terms
from swarmctl.deploy.launch_files_on_hosts import LaunchFiles
from swarmctl.deploy.prepare import Prepared
from swarmctl.plan.observed_host import Observed, from_answer
from swarmctl.plan.plan import HostPlan, Kind, Plan, Problem
from swarmctl.plan.preflight import UNFIT
from swarmctl.plan.reconcile import reconcile
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.transport import HostError, Session, Target, Transport
from swarmctl.render.bundle import Bundle

_NO_SECRETS: Mapping[str, str] = MappingProxyType({})
_TERMS = Terms()


@dataclass(frozen=True)
class Outcome:
    """The result of one host: the executed plan, and the units after it.

    ``settled``: whether an earlier deploy, which was interrupted, was confirmed or undone first.
    """

    plan: HostPlan
    units: Mapping[str, UnitState] = field(default_factory=dict)
    settled: bool = False

    @property
    def changed(self) -> bool:
        """True if the plan had steps on the host, or an earlier deploy was settled."""
        return bool(self.plan.steps) or self.settled


@dataclass(frozen=True)
class Removed:
    """The result of a removal: ``changed`` if the swarm was deployed there."""

    changed: bool


Result = Outcome | Removed | Prepared | HostError


def observe(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    diff: bool = False,
    parallel: int = parallel_hosts.PARALLEL,
    secrets: Mapping[str, str] = _NO_SECRETS,
    launch_files: LaunchFiles | None = None,
) -> Plan:
    """Observe every host and plan it; the plan of an unreachable host contains the reason.

    ``launch_files``: those to be read on hosts and checked.
    """

    def work(session: Session, target: Target, note: Callable[[str], None]) -> HostPlan:
        bundle = bundles[target.host]
        with agent_client.talk(session) as host:
            observed = look(host, bundle, contents=diff, secrets=secrets)
            if launch_files is not None:
                launch_files.read(host, bundle)
            return reconcile(bundle, observed, diff=diff)

    plans = {
        event.host: _planned(bundles[event.host], parallel_hosts.result_of(event))
        for event in parallel_hosts.run(
            _chosen(targets, bundles), work, transport=transport, parallel=parallel
        )
        if isinstance(event, parallel_hosts.Finished | parallel_hosts.Skipped)
    }
    swarm = next(iter(bundles.values())).swarm
    hosts = (plans[name] for name in bundles)
    return Plan(swarm, tuple(launch_files.checked(one) for one in hosts) if launch_files else tuple(hosts))


def deploy(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    parallel: int = parallel_hosts.PARALLEL,
    stop: parallel_hosts.Stop | None = None,
    secrets: Mapping[str, str] = _NO_SECRETS,
    stopping: Collection[str] = (),
    launch_files: LaunchFiles | None = None,
    terms: Terms = _TERMS,
) -> Iterator[parallel_hosts.Event[Outcome]]:
    """Deploy to every host its bundle, and confirm it over a new connection. Failures stay with their host.

    If one of the hosts ``stopping`` is unfit, no host is changed; a host that is away stops none.
    ``launch_files``: those to be read on hosts; a host is unfit if the rules find an error in them.
    """
    awaited = {*stopping, *(launch_files.hosts if launch_files else ())} & bundles.keys()
    at_once = parallel >= len(bundles)
    check = launch_files.checked if launch_files is not None else _unchanged
    known: list[HostPlan] = []
    if awaited and not at_once:  # they cannot all be held at the same time
        seen = observe(
            bundles, targets, transport, parallel=parallel, secrets=secrets, launch_files=launch_files
        )
        known = [one for one in seen.hosts if one.problem and one.problem.kind == UNFIT]
    fitness = Fitness(awaited if at_once else (), stopping, check, known)
    stop = stop or parallel_hosts.Stop()

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Outcome:
        bundle = bundles[target.host]

        @contextmanager
        def again() -> Iterator[agent_client.Conversation]:
            with transport.connect(target) as new, stop.guarding(new), agent_client.talk(new) as talk:
                yield talk

        with agent_client.talk(session) as host:
            transaction = HostTransaction(bundle, host, again, stop, terms, note)
            observed = look(host, bundle, secrets=secrets)
            settled = transaction.settle(observed)
            if settled:
                observed = look(host, bundle, secrets=secrets)
            if launch_files is not None and at_once:
                launch_files.read(host, bundle)
            plan = reconcile(bundle, observed)
            fitness.observed(plan)
            if launch_files is not None:
                plan = fitness.checked(plan)
            if plan.problem:
                raise refused(plan.problem)
            if not plan.steps:
                return Outcome(plan, settled=settled)
            fitness.hold()
            if due := plan.targets(Kind.SECRET):
                host.ask(_keep_secrets(bundle.swarm), _offer(due, secrets))
            return Outcome(plan, transaction.commit(plan, observed.kept))

    for event in parallel_hosts.run(
        _chosen(targets, bundles), work, transport=transport, parallel=parallel, stop=stop
    ):
        if isinstance(event, parallel_hosts.Finished | parallel_hosts.Skipped):
            fitness.left_out(event.host)
        yield event


def remove(
    swarm: str,
    targets: Iterable[Target],
    transport: Transport,
    *,
    parallel: int = parallel_hosts.PARALLEL,
    stop: parallel_hosts.Stop | None = None,
) -> Iterator[parallel_hosts.Event[Removed]]:
    """Remove the swarm from every target: stop the robots; remove units, links and folder."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Removed:
        request: RemoveRequest = {"verb": "remove", "swarm": swarm, "who": agent_client.operator()}
        with agent_client.talk(session) as host:
            return Removed(host.ask(request, on_note=note, timeout=APPLY_TIMEOUT)["removed"])

    return parallel_hosts.run(targets, work, transport=transport, parallel=parallel, stop=stop)


def look(
    host: agent_client.Conversation,
    bundle: Bundle,
    *,
    contents: bool = False,
    secrets: Mapping[str, str] = _NO_SECRETS,
) -> Observed:
    """Observe what the host runs. The host compares ``secrets``: a digest of four digits hides nothing."""
    request: ObserveRequest = {
        "verb": "observe",
        "swarm": bundle.swarm,
        "know": bundle.digest,
        "contents": contents,
    }
    if bundle.asks:
        request["requires"] = list(bundle.asks)
    if bundle.wants:
        request["wants"] = list(bundle.wants)
    offered = b""
    if bundle.secrets:
        request["secrets"] = list(bundle.secrets)
        offered = _offer(bundle.secrets, secrets)
    return from_answer(host.ask(request, offered), bundle)


def _unchanged(plan: HostPlan) -> HostPlan:
    return plan


def _keep_secrets(swarm: str) -> KeepSecretsRequest:
    return {"verb": "keep_secrets", "swarm": swarm, "who": agent_client.operator()}


def _offer(names: Iterable[str], secrets: Mapping[str, str]) -> bytes:
    return json.dumps({name: secrets[name] for name in names if name in secrets}).encode()


def _chosen(targets: Mapping[str, Target], bundles: Mapping[str, Bundle]) -> list[Target]:
    return [targets[name] for name in bundles]


def _planned(bundle: Bundle, result: HostPlan | HostError) -> HostPlan:
    if isinstance(result, HostPlan):
        return result
    problem = Problem(result.kind.value, result.message, result.hint)
    return HostPlan(bundle.host, None, bundle.digest, problem=problem)
