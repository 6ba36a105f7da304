"""Brings hosts back to releases that they have kept, in the same rounds as a deploy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from swarm_agent.history_messages import HistoryAnswer
from swarm_agent.messages import RollbackRequest

from swarmctl.deploy.deployment import Deployment, Say, Surveyed
from swarmctl.deploy.histories import history
from swarmctl.deploy.host_transaction import HostTransaction
from swarmctl.deploy.look import look
from swarmctl.plan.history import NoWayBackError, after, before_last, runs
from swarmctl.plan.plan import HostPlan, Kind, Problem, Step
from swarmctl.plan.preflight import UNFIT
from swarmctl.remote import operators
from swarmctl.remote.agent_archive import ROLLBACK_VERBS
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import Conversation, Target, Transport
from swarmctl.render.bundle import Bundle


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
        self._histories: dict[str, HistoryAnswer] = {}
        self.problem = ""

    def survey(self) -> Iterator[Event[object]]:
        """Reads the history of every host, and chooses the release of each. Yields the events."""
        yield from super().survey()
        try:
            releases = self._releases()
        except NoWayBackError as error:
            self.problem = str(error)
            return
        for host, one in self._surveyed.items():
            current = self._histories[host]["release"]
            wanted = releases.get(host, current)
            if wanted is None or wanted == current:
                continue
            step = Step(Kind.ACTIVATE, wanted, f"replaces {current}")
            kept = wanted in self._histories[host]["releases"]
            missing = f"release {wanted} is not on the host any more"
            problem = None if kept else Problem(UNFIT, missing, "deploy the spec that makes it")
            plan = HostPlan(host, current, wanted, (step,), problem=problem)
            self._surveyed[host] = replace(one, plan=plan)
        self._note_problems()

    def _releases(self) -> Mapping[str, str]:
        found = runs({host: answer["entries"] for host, answer in self._histories.items()})
        current = {host: answer["release"] for host, answer in self._histories.items()}
        if not self._to:
            return before_last(found, current)
        having = [host for host, one in self._histories.items() if self._to in one["releases"]]
        return dict.fromkeys(having, self._to) if having else after(found, self._to)

    def _look(self, target: Target, say: Say) -> Surveyed:
        bundle = self._bundles[target.host]
        with self._connections.talk(target) as host:
            observed = look(host, bundle)
            settled = self._settles and self._transaction("", target, say).settle(host, observed)
            if settled:
                observed = look(host, bundle)
            self._histories[target.host] = history(host, bundle.swarm)
        plan = HostPlan(target.host, observed.digest, observed.digest or bundle.digest)
        return Surveyed(plan, observed, settled)

    def _transaction(self, run: str, target: Target, say: Say) -> HostTransaction:
        usual = super()._transaction(run, target, say)
        if target.host not in self._surveyed:
            return usual
        return _HostRollback(**vars(usual), to=self._surveyed[target.host].plan.next)


@dataclass(frozen=True)
class _HostRollback(HostTransaction):
    """The change of a host to the release ``to``, which it has kept."""

    to: str = ""

    @property
    def release(self) -> str:
        return self.to

    def _apply(self, host: Conversation, txid: str, plan: HostPlan, kept: object) -> None:
        request: RollbackRequest = {
            "verb": "rollback",
            "swarm": self.bundle.swarm,
            "txid": txid,
            "who": operators.this_one(),
            "run": self.run,
            "base": plan.base,
            "next": plan.next,
            "confirm_within": self.terms.confirm_within,
            "stop_robots": self.stop_robots,
        }
        self._ask(host, request)
