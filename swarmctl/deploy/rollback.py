"""Brings hosts back to releases that they have kept, in the same rounds as a deploy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from swarm_onboard.agent.record import State
from swarm_onboard.agent.steps import Step
from swarm_onboard.agent.verbs import history, rollback

from swarmctl.deploy.deployment import Deployment, ObservedHost, OnProgress
from swarmctl.deploy.host_transaction import HostTransaction
from swarmctl.plan.history import NoWayBackError, after, before_last, of_release, runs, state_of
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.plan.preflight import UNFIT
from swarmctl.plan.robots_in_use import not_busy
from swarmctl.remote import agent_client, operators
from swarmctl.remote.agent_archive import ROLLBACK_VERBS
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import AgentSession, HostError, Target, Transport
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.render.bundle import Bundle

_NOTHING = State("", "")


class Rollback(Deployment):
    """As a deploy, but each host goes back: to what it had before the last run, or ``to`` a run or a release.

    ``bundles`` name the hosts; what they contain is not looked at. After the survey ``problem`` says why
    there is no way back; it is empty if there is one.
    """

    verbs: tuple[str, ...] = ROLLBACK_VERBS

    def __init__(
        self, bundles: Mapping[str, Bundle], targets: Mapping[str, Target], transport: Transport,
        *, to: str = "", **more: Any,
    ) -> None:  # fmt: skip
        super().__init__(bundles, targets, transport, **more)
        self._to = to
        self._histories: dict[str, history.Answer] = {}
        self._chosen: dict[str, State] = {}
        self.problem = ""

    def _decide(self) -> None:
        """Chooses what each host goes back to, from the histories of all."""
        try:
            states = self._states()
        except NoWayBackError as error:
            self.problem = str(error)
            return
        for host, one in self._surveyed.items():
            current = state_of(self._histories[host])
            wanted = states.get(host, current)
            if wanted is None or wanted == current:
                continue
            self._chosen[host] = wanted
            now = current.release if current else None
            problem = _missing(self._histories[host], wanted)
            self._surveyed[host] = replace(one, plan=HostPlan(host, now, wanted.release, problem=problem))
        possible = [host for host in self._chosen if not self._surveyed[host].plan.problem]
        for event in self._each(possible, self._steps_back):
            if isinstance(event, Finished):
                self._complete(event.host, event.outcome)

    def _steps_back(self, target: Target, on_progress: OnProgress) -> list[Step]:
        with self._connections.agent_session(target) as host:
            request = history.Request(self._swarm, self._chosen[target.host])
            steps = ask(host, history.handle, request).steps
        if steps is None:
            raise HostError(ErrorKind.PROTOCOL, "its history has no steps on the way back")
        return steps

    def _complete(self, host: str, steps: list[Step] | HostError) -> None:
        one = self._surveyed[host]
        if isinstance(steps, HostError):
            problem = Problem(steps.kind.value, steps.message, steps.hint)
            plan = replace(one.plan, problem=problem)
        else:
            plan = not_busy(replace(one.plan, steps=tuple(steps)), self._bundles[host], one.observed)
        self._surveyed[host] = replace(one, plan=plan)

    def _states(self) -> Mapping[str, State]:
        found = runs({host: answer.entries for host, answer in self._histories.items()})
        current = {host: state_of(answer) for host, answer in self._histories.items()}
        if not self._to:
            return before_last(found, current)
        having = {
            host: of_release(one.entries, self._to, current[host])
            for host, one in self._histories.items()
            if self._to in one.releases
        }
        return having or after(found, self._to)

    def _look(self, target: Target, on_progress: OnProgress) -> ObservedHost:
        bundle = self._bundles[target.host]
        with self._connections.agent_session(target) as host:
            observed = self._observed(host, bundle, motion=True)
            recovered = self._recovers and self._transaction("", target, on_progress).recover_interrupted(
                host, observed
            )
            if recovered:
                observed = self._observed(host, bundle, motion=True)
            self._histories[target.host] = ask(host, history.handle, history.Request(bundle.swarm))
        plan = HostPlan(target.host, observed.digest, observed.digest or bundle.digest)
        return ObservedHost(plan, observed, recovered)

    def _transaction(self, run: str, target: Target, on_progress: OnProgress) -> HostTransaction:
        usual = super()._transaction(run, target, on_progress)
        if target.host not in self._chosen:
            return usual
        return _HostRollback(**vars(usual), to=self._chosen[target.host])


def _missing(found: history.Answer, wanted: State) -> Problem | None:
    """Why the host cannot go back to ``wanted``."""
    if wanted.release not in found.releases:
        what = f"release {wanted.release} is"
    elif wanted.secrets and wanted.secrets not in found.secret_sets:
        what = f"the secrets that release {wanted.release} had are"
    else:
        return None
    return Problem(UNFIT, f"{what} not on the host any more", "deploy the spec that makes it")


@dataclass(frozen=True)
class _HostRollback(HostTransaction):
    """The change of a host to the state ``to``, which it has kept."""

    to: State = _NOTHING

    @property
    def release(self) -> str:
        return self.to.release

    def _apply(self, host: AgentSession, txid: str, plan: HostPlan, kept: object) -> rollback.Answer:
        request = rollback.Request(
            self.bundle.swarm,
            txid,
            plan.previous,
            plan.next,
            self.to.secrets,
            self.terms.confirm_within,
            who=operators.this_one(),
            run=self.run,
            stop_robots=self.stop_robots,
            issued=self.issued,
        )
        return ask(host, rollback.handle, request, on_note=self.note, timeout=agent_client.CHANGE_TIMEOUT)
