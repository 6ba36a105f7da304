"""Makes hosts fit: each is observed, planned and changed on one connection; failures stay with their host."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import groupby

from swarm_onboard.agent.verbs import inventory
from swarm_onboard.agent.verbs import prepare as prepare_verb

from swarmctl.plan.host_needs import HostNeeds
from swarmctl.plan.host_preparation import HostPreparation, Kind, Step, preparation
from swarmctl.plan.plan import Problem
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import AgentSession, HostError, Session, Target, Transport
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.render.bundle import workspace

_VERBS = ("inventory", "prepare")
_LOOK_TIMEOUT = 120.0  # s; apt-cache takes seconds on a slow memory card
_STEP_TIMEOUT = 7500.0  # s; above the agent's own limit of the longest step


@dataclass(frozen=True)
class Prepared:
    """The steps that were carried out on a host, which is fit now."""

    steps: tuple[Step, ...]

    @property
    def changed(self) -> bool:
        """True if there were steps."""
        return bool(self.steps)


def observe(
    wanted: Mapping[str, HostNeeds],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    login: str = "",
    parallel: int,
) -> tuple[HostPreparation, ...]:
    """Look at every host and plan it; the plan of a host that cannot be looked at contains the reason."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> HostPreparation:
        needs = wanted[target.host]
        with agent_client.agent_session(session, verbs=_VERBS) as host:
            return preparation(needs, _look(host, needs), login=login)

    events = parallel_hosts.run(_chosen(wanted, targets, login), work, transport=transport, parallel=parallel)
    found = parallel_hosts.results_of(events)
    return tuple(_planned(name, found[name]) for name in wanted)


def prepare(
    wanted: Mapping[str, HostNeeds],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    login: str = "",
    parallel: int,
    stop: parallel_hosts.Stop | None = None,
) -> Iterator[parallel_hosts.Event[Prepared]]:
    """Carry out the steps of every host; a host that lacks something all the same ends in an error."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Prepared:
        needs = wanted[target.host]
        with agent_client.agent_session(session, verbs=_VERBS) as host:
            return _prepared(host, needs, login, note)

    return parallel_hosts.run(
        _chosen(wanted, targets, login), work, transport=transport, parallel=parallel, stop=stop
    )


def _prepared(host: AgentSession, needs: HostNeeds, login: str, note: Callable[[str], None]) -> Prepared:
    def planned(*, refreshed: bool) -> HostPreparation:
        plan = preparation(needs, _look(host, needs), login=login, refreshed=refreshed)
        if plan.problem:
            raise HostError(ErrorKind.REFUSED, plan.problem.message, plan.problem.hint)
        return plan

    plan, done = planned(refreshed=False), []
    # What the fresh lists have is known only after them.
    first = [step for step in plan.steps if step.kind in (Kind.SOURCE, Kind.REFRESH)]
    if first:
        for step in first:
            done += _carry_out(host, [step], needs, login, note)
        plan = planned(refreshed=True)
    for _, steps in groupby(plan.steps, key=lambda step: step.kind):
        done += _carry_out(host, list(steps), needs, login, note)
    left = planned(refreshed=True) if done else plan
    if not left.fit:
        raise _unfit(left)
    return Prepared(tuple(done))


def _carry_out(
    host: AgentSession,
    steps: list[Step],
    needs: HostNeeds,
    login: str,
    note: Callable[[str], None],
) -> list[Step]:
    kind, targets = steps[0].kind, [step.target for step in steps]
    note(f"{kind.value} {' '.join(targets)}")
    request = prepare_verb.Request(
        needs.swarm, kind.value, targets, needs.account, login, list(needs.workspaces)
    )
    ask(host, prepare_verb.handle, request, on_note=note, timeout=_STEP_TIMEOUT)
    return steps


def _look(host: AgentSession, needs: HostNeeds) -> inventory.Answer:
    requirements = [need.requirement for need in needs.packages if need.requirement]
    request = inventory.Request(
        needs.swarm,
        requires=[workspace(path) for path in needs.workspaces] + requirements,
        debian=list(needs.debian),
        pip=list(needs.pip),
        rosdep=list(needs.keys),
        distro=needs.distro,
        account=needs.account,
        groups=list(needs.groups),
        workspaces=list(needs.workspaces),
        images=list(needs.images),
    )
    return ask(host, inventory.handle, request, timeout=_LOOK_TIMEOUT)


def _unfit(left: HostPreparation) -> HostError:
    problems = [one.message for one in left.lacks] + [
        f"{step.kind.value} {step.target}" for step in left.steps
    ]
    hint = (
        left.lacks[0].hint if left.lacks else "run the same command again; its output names the failing step"
    )
    return HostError(ErrorKind.REFUSED, f"it still lacks {'; '.join(problems)}", hint)


def _chosen(wanted: Mapping[str, HostNeeds], targets: Mapping[str, Target], login: str) -> Iterator[Target]:
    for name in wanted:
        yield replace(targets[name], user=login) if login else targets[name]


def _planned(host: str, result: HostPreparation | HostError) -> HostPreparation:
    if isinstance(result, HostPreparation):
        return result
    return HostPreparation(host, problem=Problem(result.kind.value, result.message, result.hint))
