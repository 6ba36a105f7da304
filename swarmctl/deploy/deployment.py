"""A deploy in rounds: every host is surveyed, then gives its lease, then the hosts change wave by wave."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from itertools import chain

from swarm_onboard.agent.systemd import UnitState

from swarmctl.deploy.host_list_updates import write_all
from swarmctl.deploy.host_lists import HostLists
from swarmctl.deploy.host_transaction import HostTransaction
from swarmctl.deploy.motion_guard import Guard, Seen, host_error
from swarmctl.deploy.observe_host import NO_SECRETS, observe_host
from swarmctl.deploy.outcome import Outcome, Rules, held, locked_ones, why
from swarmctl.deploy.rollout import planned
from swarmctl.deploy.swarm_lease import SwarmLease
from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan, Plan
from swarmctl.plan.reconcile import reconcile
from swarmctl.plan.robots_in_use import BUSY, Dependents, not_busy, stops_of
from swarmctl.plan.waves import Order
from swarmctl.remote import parallel_hosts
from swarmctl.remote.agent_archive import DEPLOY_VERBS
from swarmctl.remote.connections import Connections
from swarmctl.remote.parallel_hosts import Event, Finished, Note, Stop, not_started
from swarmctl.remote.transport import AgentSession, HostError, Target, Transport
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.render.bundle import Bundle

OnProgress = Callable[[str], None]
_LOOK_AGAIN = 1.0  # s between two looks at a host


@dataclass(frozen=True)
class ObservedHost:
    """A host before a change. ``recovered``: an earlier deploy was finished or undone."""

    plan: HostPlan
    observed: Observed
    recovered: bool


@dataclass(frozen=True)
class _Pending:
    """A change that waits for its confirmation."""

    txid: str
    units: Mapping[str, UnitState]
    seconds: float = 0.0


class Deployment:
    """A deploy of ``bundles``. First ``survey`` it, then ``change`` the hosts. Use it as a context manager.

    ``dependents``: what robots need beside their own drivers, all of whose hosts are in ``targets``;
    ``host_lists``: takes the lists of hosts in the survey; after a change the hosts get the present one;
    ``recovers``: the survey finishes what an interrupted deploy has left on a host.
    """

    verbs: tuple[str, ...] = DEPLOY_VERBS  # of the agent

    def __init__(
        self,
        bundles: Mapping[str, Bundle],
        targets: Mapping[str, Target],
        transport: Transport,
        *,
        rules: Rules,
        parallel: int,
        stop: Stop | None = None,
        secrets: Mapping[str, str] = NO_SECRETS,
        host_lists: HostLists | None = None,
        dependents: Dependents | None = None,
        recovers: bool = True,
    ) -> None:
        self._bundles = bundles
        self._targets = targets
        self._rules = rules
        self._parallel = parallel
        self._stop = stop or Stop()
        self._secrets = secrets
        self._host_lists = host_lists
        self._recovers = recovers
        self._connections = Connections(transport, self._stop, self.verbs)
        self._guard = (
            Guard(
                dependents, targets, self._connections, parallel, self._stop,
                lenient=rules.most_failed is None, stop_robots=rules.stop_robots,
                without_away=rules.when_seen,
            )
            if dependents
            else None
        )  # fmt: skip
        self._surveyed: dict[str, ObservedHost] = {}
        self._seconds: dict[str, float] = {}  # that the survey took, by host
        self.errors: dict[str, HostError] = {}

    def __enter__(self) -> Deployment:
        return self

    def __exit__(self, *_: object) -> None:
        self._connections.close()

    def survey(self) -> Iterator[Event[object]]:
        """Observes every host. Yields the events; the errors are kept in ``errors``."""
        until = time.monotonic() + self._rules.wait
        for event in self._each(
            self._bundles, lambda target, on_progress: self._waited(target, on_progress, until)
        ):
            if isinstance(event, Finished):
                found = event.outcome
                self._seconds[event.host] = event.seconds
                if isinstance(found, HostError):
                    self.errors[event.host] = found
                else:
                    self._surveyed[event.host] = found
            yield event
        self._decide()
        yield from self._look_at_dependents(until)
        for host, one in self._surveyed.items():
            if problem := one.plan.problem:
                self.errors[host] = host_error(problem)

    def _decide(self) -> None:
        """Completes the plans, once all hosts are observed; those of a deploy are complete."""

    def _look_at_dependents(self, until: float) -> Iterator[Note]:
        """Gives plans a problem if robots in use on any host depend on what they stop."""
        if self._guard is None:
            return
        stops = {host: stops_of(one.plan) for host, one in self._surveyed.items() if not one.plan.problem}
        away = self._away()
        seen, noted = self._guard.look(stops, away), False
        while seen.problems and time.monotonic() < until and not self._stop.requested:
            if not noted:
                yield from (Note(host, f"waiting: {one.message}") for host, one in seen.problems.items())
                noted = True
            time.sleep(_LOOK_AGAIN)
            seen = self._guard.look(stops, away)
        yield from seen.notes
        for host, problem in seen.problems.items():
            one = self._surveyed[host]
            self._surveyed[host] = replace(one, plan=replace(one.plan, problem=problem))

    @property
    def hosts(self) -> list[str]:
        """The hosts, in the order of the spec."""
        return list(self._bundles)

    def leave_nobody_out(self) -> None:
        """Has each host that does not answer hold back the others."""
        self._rules = replace(self._rules, apart=())

    def held(self, order: Order) -> bool:
        """True if none will change: so many hosts have failed in the survey, or another run is at work."""
        return bool(locked_ones(self.errors)) or self._rules.of(order).holds(self.errors)

    @property
    def plan(self) -> Plan:
        """What ``change`` would do. After the survey."""
        found = {
            name: self._surveyed[name].plan if name in self._surveyed else planned(bundle, self.errors[name])
            for name, bundle in self._bundles.items()
        }
        return Plan(next(iter(self._bundles.values())).swarm, tuple(found.values()))

    @property
    def due(self) -> list[HostPlan]:
        """The plans with steps, of hosts that can execute them."""
        return [plan for plan in self.plan.hosts if plan.steps and not plan.problem]

    def change(self, order: Order) -> Iterator[Event[Outcome]]:
        """Executes the plans in this order. Every host ends in exactly one ``Finished``."""
        self._rules = self._rules.of(order)
        deployed = []
        for event in self._changes(order):
            if isinstance(event, Finished) and not isinstance(event.outcome, HostError):
                deployed.append(event.host)
            yield event
        self._store_host_list(deployed)

    def _store_host_list(self, deployed: Collection[str]) -> None:
        """Stores on these hosts which hosts the swarm has. One that does not take it gets it next time."""
        if self._host_lists is not None and not self._stop.requested:
            wanted = self._host_lists.wanted(deployed, self._bundles)
            targets = [self._targets[name] for name in self._host_lists.outdated(deployed, wanted)]
            write_all(self._host_lists, wanted, targets, self._connections, parallel=self._parallel)

    def _changes(self, order: Order) -> Iterator[Event[Outcome]]:
        for name in self._bundles:
            if name in self.errors:
                yield Finished(name, self.errors[name], self._seconds[name])
            elif not (one := self._surveyed[name]).plan.steps:
                yield Finished(name, Outcome(one.plan, recovered=one.recovered), self._seconds[name])
        waves = [list(wave) for wave in order.waves]
        failed = self._rules.counted(self.errors)
        if not waves:
            return
        if self._stop.requested:
            yield from (not_started(host) for wave in waves for host in wave)
            return
        if locked := locked_ones(self.errors):  # whatever may fail: another run is at work
            yield from held(waves, f"nothing was changed, since {why(locked)}")
            return
        if self._rules.holds(failed):
            yield from held(waves, f"nothing was changed, since {why(failed)}")
            return
        with SwarmLease(self._swarm, self._connections, parallel=self._parallel, stop=self._stop) as lease:
            yield from self._with_lease(lease, waves, failed, together=order.together)

    def _with_lease(
        self, lease: SwarmLease, waves: list[list[str]], failed: dict[str, HostError], *, together: bool
    ) -> Iterator[Event[Outcome]]:
        seen = {name: one.observed for name, one in self._surveyed.items()}
        refusals = lease.take([self._targets[name] for name in seen], seen)
        due = {host for wave in waves for host in wave}
        yield from (Finished(host, error, 0.0) for host, error in refusals.items() if host in due)
        waves = [[host for host in wave if host not in refusals] for wave in waves]
        failed |= self._rules.counted(refusals)
        if locked := {host: one for host, one in refusals.items() if one.kind is ErrorKind.REFUSED}:
            yield from held(waves, f"nothing was changed, since {why(locked)}")
            return
        changed = "nothing was changed"
        while waves and not self._rules.holds(failed):
            in_use = self._clear(waves)
            yield from in_use.notes
            busy = {host: host_error(problem) for host, problem in in_use.problems.items()}
            yield from (Finished(host, error, 0.0) for host, error in busy.items())
            failed |= self._rules.counted(busy)
            waves = [[host for host in wave if host not in busy] for wave in waves]
            if self._rules.holds(failed):
                break
            wave, *waves = waves
            for event in self._wave(lease, wave, failed, together=together):
                if isinstance(event, Finished) and isinstance(error := event.outcome, HostError):
                    failed |= self._rules.counted({event.host: error})
                yield event
            changed = "the rollout has stopped before it"
        if waves:
            yield from held(waves, f"{changed}, since {why(failed)}")

    def _clear(self, waves: Sequence[Sequence[str]]) -> Seen:
        """Looks once more at the robots that depend on the first of these waves, or stops those of all."""
        if self._guard is None or self._stop.requested:
            return Seen({})
        hosts = chain.from_iterable(waves if self._rules.stop_robots else waves[:1])
        stops = {host: stops_of(self._surveyed[host].plan) for host in hosts}
        return self._guard.clear(stops, self._away())

    def _away(self) -> dict[str, str]:
        """Why hosts did not answer in the survey, or an empty text if their errors hold back all others."""
        errors = {host: self.errors[host] for host in self._bundles.keys() - self._surveyed.keys()}
        return {host: str(one) if one.kind in self._rules.apart else "" for host, one in errors.items()}

    def _wave(
        self, lease: SwarmLease, wave: list[str], failed: Mapping[str, HostError], *, together: bool
    ) -> Iterator[Event[Outcome]]:
        def commit(target: Target, on_progress: OnProgress) -> Outcome:
            one = self._surveyed[target.host]
            with self._connections.agent_session(target) as host:
                units = self._transaction(lease.run, target, on_progress).commit(
                    host, one.plan, one.observed.kept
                )
            return Outcome(one.plan, units, one.recovered)

        if together and len(wave) > 1:
            yield from self._together(lease, wave, failed)
        else:
            yield from _unstarted(self._each(wave, commit))

    def _together(
        self, lease: SwarmLease, wave: list[str], failed: Mapping[str, HostError]
    ) -> Iterator[Event[Outcome]]:
        """Changes the hosts of a wave, and confirms them only if not too many have failed."""
        pending: dict[str, _Pending] = {}

        def change(target: Target, on_progress: OnProgress) -> _Pending:
            one = self._surveyed[target.host]
            with self._connections.agent_session(target) as host:
                found = self._transaction(lease.run, target, on_progress).change(
                    host, one.plan, one.observed.kept
                )
            lease.waits(target.host, found[0], self._rules.terms.confirm_within)
            return _Pending(*found)

        def confirm(target: Target, on_progress: OnProgress) -> Outcome:
            one = self._surveyed[target.host]
            self._transaction(lease.run, target, on_progress).confirm(pending[target.host].txid)
            return Outcome(one.plan, pending[target.host].units, one.recovered)

        def undo(target: Target, on_progress: OnProgress) -> Outcome:
            self._transaction(lease.run, target, on_progress).undo(pending[target.host].txid)
            previous = self._surveyed[target.host].plan.previous
            back = (
                f"it was changed and is back at release {previous}"
                if previous
                else "it was changed and is as before"
            )
            raise HostError(ErrorKind.HELD, f"{back}, since {why(failures)}")

        failures = dict(failed)
        for event in _unstarted(self._each(wave, change)):
            if isinstance(event, Note):
                yield event
            elif isinstance(found := event.outcome, HostError):
                failures |= self._rules.counted({event.host: found})
                yield Finished(event.host, found, event.seconds)
            else:
                pending[event.host] = replace(found, seconds=event.seconds)
        end = undo if self._rules.holds(failures) or self._stop.requested else confirm
        if self._stop.requested:
            failures = failures or {"the rollout": HostError(ErrorKind.STOPPED, "was interrupted")}
        for last in _unstarted(self._each(pending, end, stop=Stop())):
            if isinstance(last, Finished):
                lease.decided(last.host)
                yield replace(last, seconds=last.seconds + pending[last.host].seconds)
            else:
                yield last

    def _waited(self, target: Target, on_progress: OnProgress, until: float) -> ObservedHost:
        """Observes a host until no robot is in use and all terms hold, or until the moment ``until``."""
        found, recovered, noted = self._look(target, on_progress), False, False
        while (problem := found.plan.problem) and problem.kind == BUSY and time.monotonic() < until:
            if self._stop.requested:
                break
            if not noted:
                on_progress(f"waiting: {problem.message}")
                noted = True
            time.sleep(_LOOK_AGAIN)
            recovered |= found.recovered
            found = self._look(target, on_progress)
        return replace(found, recovered=found.recovered or recovered)

    def _look(self, target: Target, on_progress: OnProgress) -> ObservedHost:
        bundle = self._bundles[target.host]
        with self._connections.agent_session(target) as host:
            observed = self._observed(host, bundle)
            recovered = self._recovers and self._transaction("", target, on_progress).recover_interrupted(
                host, observed
            )
            if recovered:
                observed = self._observed(host, bundle)
            if self._host_lists is not None:
                self._host_lists.read(host, target.host, observed)
        plan = reconcile(bundle, observed)
        if stops_of(plan) and not plan.problem:
            observed = self._observed_in_use(target, bundle)
            plan = reconcile(bundle, observed)
        plan = self._rules.allowed(plan, bundle, observed)
        return ObservedHost(plan if plan.problem else not_busy(plan, bundle, observed), observed, recovered)

    def _transaction(self, run: str, target: Target, on_progress: OnProgress) -> HostTransaction:
        def connect(anew: bool) -> AbstractContextManager[AgentSession]:
            return self._connections.agent_session(target, anew=anew)

        return HostTransaction(
            self._bundles[target.host], run, connect, lambda: self._connections.log_in(target), self._stop,
            self._rules.terms, on_progress,
            stop_robots=self._rules.stop_robots, secrets=self._secrets, issued=self._rules.issued,
        )  # fmt: skip

    def _observed_in_use(self, target: Target, bundle: Bundle) -> Observed:
        """Observes a host, and asks its drivers, which answer slowly; anew if its agent has just ended."""
        try:
            with self._connections.agent_session(target) as host:
                return self._observed(host, bundle, motion=True)
        except HostError as error:
            if error.kind not in (ErrorKind.LOST, ErrorKind.PROTOCOL):
                raise
        with self._connections.agent_session(target, anew=True) as host:
            return self._observed(host, bundle, motion=True)

    def _observed(self, host: AgentSession, bundle: Bundle, *, motion: bool = False) -> Observed:
        return observe_host(
            host, bundle, secrets=self._secrets, motion=motion, stop_robots=self._rules.stop_robots
        )

    @property
    def _swarm(self) -> str:
        return next(iter(self._bundles.values())).swarm

    def _each(
        self,
        hosts: Iterable[str],
        work: Callable[[Target, OnProgress], parallel_hosts.R],
        stop: Stop | None = None,
    ) -> Iterator[Event[parallel_hosts.R]]:
        chosen = [self._targets[name] for name in hosts]
        return parallel_hosts.each(chosen, work, parallel=self._parallel, stop=stop or self._stop)


def _unstarted(
    events: Iterator[Event[parallel_hosts.R]],
) -> Iterator[Note | Finished[parallel_hosts.R]]:
    """The events without ``Started``: the survey has shown the start."""
    return (event for event in events if not isinstance(event, parallel_hosts.Started))
