"""Rounds of a deploy: the first to all hosts, and others until those that were away have the release."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swarmctl.cli import console, left_hosts, rollout_output
from swarmctl.deploy.outcome import WAITS, why
from swarmctl.remote.transport import HostError

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


def awaited(found: Mapping[str, object]) -> dict[str, HostError]:
    """Returns the hosts that may get the release later by themselves, each with what keeps it from them."""
    return {host: one for host, one in found.items() if isinstance(one, HostError) and one.kind in WAITS}


@dataclass(frozen=True)
class Rounds:
    """A deploy of ``wanted`` by ``rules``. ``sizes`` and ``consistency``: as ``waves.order`` takes them."""

    where: Where
    document: Document
    view: View
    wanted: Mapping[str, Bundle]
    rules: Rules
    sizes: Sequence[str]
    consistency: Consistency | None
    stop: Stop

    def first(self, *, dry_run: bool, yes: bool, saved: SavedPlan | None = None) -> Mapping[str, Result]:
        """Deploys to all hosts, and reports it. Exits after a dry run."""
        found = self._deployed(dry_run=dry_run, yes=yes, saved=saved)
        self._report(found, found)
        return found

    def until_all_are_seen(self, found: Mapping[str, Result]) -> Mapping[str, Result]:
        """Deploys again each time that one of the hosts answers that were away, until none is left."""
        while (away := awaited(found)) and not self.stop.requested:
            self.remember_awaited(away)
            console.err().print(f"waiting, since {why(away)}; Ctrl-C ends it")
            self.await_one(away)
            if not self.stop.requested:
                found = self._deployed(dry_run=False, yes=True)
                self._report({host: one for host, one in found.items() if host in away}, found)
        self.remember_awaited({})
        return found

    def again(self) -> Mapping[str, Result]:
        """Deploys to all hosts, and reports nothing."""
        return self._deployed(dry_run=False, yes=True)

    def _deployed(self, *, dry_run: bool, yes: bool, saved: SavedPlan | None = None) -> Mapping[str, Result]:
        from swarmctl.deploy.deployment import Deployment
        from swarmctl.plan.robots_in_use import Dependents
        from swarmctl.plan.waves import order
        from swarmctl.render.middleware import middleware_of

        swarm, where = self.view.swarm, self.where
        lists = left_hosts.lists_of(swarm)
        shared = frozenset().union(*(middleware_of(one).shared_files for one in swarm.distros))
        secrets = where.secrets(self.wanted)

        def chosen(one: Deployment) -> Order:
            return order(one.due, self._impacts(one), self.sizes, self.consistency, shared)

        with where.transport(secrets=bool(secrets)) as transport:
            deployment = Deployment(
                self.wanted, where.targets(swarm), transport, rules=self.rules, parallel=where.parallel,
                stop=self.stop, secrets=secrets, host_lists=lists, dependents=Dependents(swarm),
                recovers=not dry_run,
            )  # fmt: skip
            found = self.view.executed(deployment, self.stop, chosen, dry_run=dry_run, yes=yes, saved=saved)
        with rollout_output.journal_warnings():
            self._remember(found)
            left = left_hosts.left_hosts(swarm, lists, in_lab=where.in_lab)
            rollout_output.warn_of_left_hosts(left, where)
        return found

    def _impacts(self, deployment: Deployment) -> Sequence[Impact]:
        """What is lost with each part of the swarm, which orders the hosts; one host needs no order."""
        from swarmctl.analysis.impact import impacts
        from swarmctl.swarm.index import SwarmIndex

        return impacts(SwarmIndex(self.document)) if len(deployment.due) > 1 else ()

    def _report(self, shown: Mapping[str, Result], found: Mapping[str, Result]) -> None:
        """Prints the results of some of the hosts that were ``found``."""
        if self.view.json:
            return
        swarm, where = self.view.swarm, self.where
        rollout_output.report(
            swarm, shown, where.complete, rollout_output.absent(shown, swarm.hosts),
            details=self.view.details, interrupted=self.stop.requested,
        )  # fmt: skip
        if not where.in_lab:
            where.guess_lab("deploy", swarm.name, rollout_output.errors(found))

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

    def await_one(self, away: Mapping[str, HostError], longest: float = math.inf) -> None:
        """Returns once one of the hosts answers, ``longest`` s have passed, or Ctrl-C requests the end."""
        from swarmctl.remote.parallel_hosts import interruptible, results_of, run

        targets, end = self.where.targets(self.view.swarm), time.monotonic() + longest
        with interruptible(stop=self.stop), self.where.transport() as transport:
            while not self.stop.requested and time.monotonic() < end:
                due = min(end, time.monotonic() + _EVERY)
                while not self.stop.requested and time.monotonic() < due:
                    time.sleep(0.2)
                looks = run(
                    [targets[host] for host in away],
                    lambda *_: None,
                    transport=transport,
                    parallel=self.where.parallel,
                    stop=self.stop,
                )
                if len(awaited(results_of(looks))) < len(away):
                    return
