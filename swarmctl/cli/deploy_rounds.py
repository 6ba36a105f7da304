"""Rounds of a deploy: the first to all hosts, and others until those that were away have the release."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from swarmctl.cli import console, left_hosts, rollout_output
from swarmctl.deploy.outcome import WAITS, locked_ones, why
from swarmctl.remote.transport import HostError, Kind

if TYPE_CHECKING:
    from swarmctl.analysis.impact import Impact
    from swarmctl.cli.deploy_steps import View
    from swarmctl.cli.saved_plan import SavedPlan
    from swarmctl.cli.where import Where
    from swarmctl.deploy.deployment import Deployment
    from swarmctl.deploy.outcome import Result, Rules
    from swarmctl.plan.waves import Consistency, Order
    from swarmctl.remote.parallel_hosts import Stop
    from swarmctl.render.bundle import Bundle
    from swarmctl.spec.load import Document

_EVERY = 10.0  # s between two looks whether hosts answer
_EVERY_BUSY = 30.0  # s between two looks at robots in use, and at hosts that another run changes
_REST = 3600.0  # s before a release is tried again on a host where it has failed


def awaited(found: Mapping[str, object]) -> dict[str, HostError]:
    """Returns the hosts that may get the release later by themselves, each with what keeps it from them."""
    errors = {host: one for host, one in found.items() if isinstance(one, HostError)}
    return {host: one for host, one in errors.items() if one.kind in WAITS} | locked_ones(errors)


def _booting(found: Mapping[str, Result], away: Mapping[str, HostError]) -> dict[str, HostError]:
    """Returns the hosts that begin to answer, and let nobody in yet, or answer in part."""
    return {
        host: one
        for host, one in found.items()
        if host in away and away[host].kind is Kind.UNREACHABLE
        if isinstance(one, HostError) and one.kind in (Kind.AUTH, Kind.PRIVILEGE, Kind.PROTOCOL)
    }


def _kept(before: Result, last: Result) -> Result:
    """Returns the result of a host for the whole run: one that was changed before has nothing to do now."""
    nothing = not isinstance(last, HostError) and not last.changed
    return before if nothing and not isinstance(before, HostError) else last


def news(found: Mapping[str, Result], before: Mapping[str, Result]) -> dict[str, Result]:
    """Returns the results of hosts that were changed, or have another kind of error than before."""

    def is_new(host: str, one: Result) -> bool:
        old = before.get(host)
        if isinstance(one, HostError):
            return not isinstance(old, HostError) or old.kind is not one.kind
        return one.changed or isinstance(old, HostError)

    return {host: one for host, one in found.items() if is_new(host, one)}


@dataclass(frozen=True)
class Rounds:
    """A deploy of ``wanted`` by ``rules``. ``sizes`` and ``consistency``: as ``waves.order`` takes them.

    ``failed``: when a release last failed on a host, by both, in s of ``time.monotonic``.
    """

    where: Where
    document: Document
    view: View
    wanted: Mapping[str, Bundle]
    rules: Rules
    sizes: Sequence[str]
    consistency: Consistency | None
    stop: Stop
    failed: dict[tuple[str, str], float] = field(default_factory=dict)

    def first(self, *, dry_run: bool, yes: bool, saved: SavedPlan | None = None) -> Mapping[str, Result]:
        """Deploys to all hosts, and reports it. Exits after a dry run."""
        found = self._deployed(dry_run=dry_run, yes=yes, saved=saved)
        self.report(found)
        if not (self.where.in_lab or self.view.json):
            self.where.guess_lab("deploy", self.view.swarm.name, rollout_output.errors(found))
        return found

    def until_all_are_seen(self, found: Mapping[str, Result]) -> Mapping[str, Result]:
        """Deploys again each time that one of the hosts answers that were away, until none is left.

        Returns the last result of each host, or that of its change.
        """
        text, away = "", awaited(found)
        while away and not self.stop.requested:
            self.remember_awaited(away)
            if why(away) != text:
                text = why(away)
                console.err().print(f"waiting, since {text}; Ctrl-C ends it")
            self.await_one(away)
            if self.stop.requested:
                break
            last = self.again()
            self.report(news(last, found))
            away = awaited(last) | _booting(last, away)
            found = {host: _kept(found[host], one) for host, one in last.items()}
        self.remember_awaited({})
        return found

    def again(self) -> Mapping[str, Result]:
        """Deploys to all hosts, and reports nothing."""
        return self._deployed(dry_run=False, yes=True, again=True)

    def _deployed(
        self, *, dry_run: bool, yes: bool, saved: SavedPlan | None = None, again: bool = False
    ) -> Mapping[str, Result]:
        from swarmctl.deploy.deployment import Deployment
        from swarmctl.plan.robots_in_use import Dependents
        from swarmctl.plan.waves import order
        from swarmctl.render.middleware import middleware_of

        swarm, where = self.view.swarm, self.where
        lists = left_hosts.lists_of(swarm)
        shared = frozenset().union(*(middleware_of(one).shared_files for one in swarm.distros))
        secrets = where.secrets(self.wanted)

        def chosen(one: Deployment) -> Order:
            if self._have_moved(one.errors):
                one.leave_nobody_out()
            return order(one.due, self._impacts(one), self.sizes, self.consistency, shared)

        failed = self.failed_before()
        with where.transport(secrets=bool(secrets)) as transport:
            deployment = Deployment(
                self.wanted, where.targets(swarm), transport, rules=replace(self.rules, failed=failed),
                parallel=where.parallel, stop=self.stop, secrets=secrets, host_lists=lists,
                dependents=Dependents(swarm), recovers=not dry_run,
            )  # fmt: skip
            found = self.view.executed(deployment, self.stop, chosen, dry_run=dry_run, yes=yes, saved=saved)
        for host, one in found.items():
            if isinstance(one, HostError) and one.kind is Kind.FAILED and host not in failed:
                self.failed[host, self.wanted[host].digest] = time.monotonic()
        with rollout_output.journal_warnings():
            self._remember(found)
            if not again:
                left = left_hosts.left_hosts(swarm, lists, in_lab=where.in_lab)
                rollout_output.warn_of_left_hosts(left, where)
        return found

    def failed_before(self) -> list[str]:
        """Returns the hosts on which their release has failed within the last hour."""
        since = time.monotonic() - _REST
        return [
            host
            for host, bundle in self.wanted.items()
            if self.failed.get((host, bundle.digest), -math.inf) > since
        ]

    def _have_moved(self, errors: Mapping[str, HostError]) -> bool:
        """Returns True if a host that failed still has a unit which the release gives to another one."""
        from swarmctl.deploy import journal

        place = journal.folder(self.view.swarm.name)
        for host in () if self.where.in_lab else errors:
            own = {unit.name for unit in self.wanted[host].units}
            gone = journal.recall(place, host).unit_digests.keys() - own
            if any(unit.name in gone for other in self.wanted.values() for unit in other.units):
                return True
        return False

    def _impacts(self, deployment: Deployment) -> Sequence[Impact]:
        """What is lost with each part of the swarm, which orders the hosts; one host needs no order."""
        from swarmctl.analysis.impact import impacts
        from swarmctl.swarm.index import SwarmIndex

        return impacts(SwarmIndex(self.document)) if len(deployment.due) > 1 else ()

    def report(self, found: Mapping[str, Result]) -> None:
        """Prints the results of hosts."""
        if found and not self.view.json:
            swarm, where = self.view.swarm, self.where
            rollout_output.report(
                swarm, found, where.complete, rollout_output.absent(found, swarm.hosts),
                details=self.view.details, interrupted=self.stop.requested,
            )  # fmt: skip

    def _remember(self, found: Mapping[str, Result]) -> None:
        """Stores which hosts failed, for `--retry-failed`, and what real ones have, for `plan --offline`."""
        from swarmctl.deploy import journal
        from swarmctl.deploy.outcome import Outcome

        in_lab = self.where.in_lab
        place = journal.folder(self.view.swarm.name)
        errors = [name for name, one in found.items() if isinstance(one, HostError)]
        journal.remember_failed(place, errors, lab=in_lab)
        for name, result in found.items():
            if isinstance(result, Outcome) and not in_lab:
                login = left_hosts.stored_login(self.view.swarm.hosts[name])
                journal.remember(place, name, self.wanted[name].digest, self.wanted[name].manifest, login)

    def remember_awaited(self, away: Mapping[str, HostError]) -> None:
        """Stores for `status` on this machine which hosts are waited for, and why."""
        from swarmctl.deploy import journal

        with rollout_output.journal_warnings():
            place = journal.folder(self.view.swarm.name)
            texts = {host: str(one) for host, one in away.items()}
            journal.remember_awaited(place, texts, lab=self.where.in_lab)

    def await_one(self, away: Mapping[str, HostError], longest: float | None = None) -> None:
        """Returns once one of the hosts answers that did not, Ctrl-C requests the end, or ``longest`` s pass.

        That is 30 s by default if something else keeps some of the hosts, and without limit if not.
        """
        from swarmctl.remote.parallel_hosts import interruptible, results_of, run

        silent = [host for host, one in away.items() if one.kind is Kind.UNREACHABLE]
        if longest is None:
            longest = math.inf if len(silent) == len(away) else _EVERY_BUSY
        targets, end = self.where.targets(self.view.swarm), time.monotonic() + longest
        with interruptible(stop=self.stop), self.where.transport() as transport:
            while not self.stop.requested and time.monotonic() < end:
                due = min(end, time.monotonic() + _EVERY)
                while not self.stop.requested and time.monotonic() < due:
                    time.sleep(0.2)
                looks = run(
                    [targets[host] for host in silent],
                    lambda *_: None,
                    transport=transport,
                    parallel=self.where.parallel,
                    stop=self.stop,
                )
                if len(awaited(results_of(looks))) < len(silent):
                    return
