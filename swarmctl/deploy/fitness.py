"""Holds every host before its first change until all were observed; lets none go on if one is unfit."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable

from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.remote.transport import HostError, Kind


class Fitness:
    """The plans of ``hosts``; complete once each is either observed or left out.

    A host of ``stopping`` whose plan has a problem stops all others. ``check`` adds to a plan what only shows
    when all are complete. ``known``: plans of hosts that were observed before.
    """

    def __init__(
        self,
        hosts: Iterable[str],
        stopping: Iterable[str],
        check: Callable[[HostPlan], HostPlan],
        known: Iterable[HostPlan] = (),
    ) -> None:
        self._missing = set(hosts)
        self._stopping = frozenset(stopping)
        self._check = check
        self._plans = {plan.host: plan for plan in known}
        self._changed = threading.Condition()

    def observed(self, plan: HostPlan) -> None:
        """Record the plan of a host that is waited for."""
        with self._changed:
            if plan.host in self._missing:
                self._plans[plan.host] = plan
        self.left_out(plan.host)

    def left_out(self, host: str) -> None:
        """Wait for this host no longer: it cannot be reached, or does not count."""
        with self._changed:
            self._missing.discard(host)
            self._changed.notify_all()

    def checked(self, plan: HostPlan) -> HostPlan:
        """Wait until all hosts are known; returns the plan with what the check adds."""
        self._wait()
        return self._check(plan)

    def hold(self) -> None:
        """Wait until all hosts are known. Raises ``HostError`` if one is unfit."""
        self._wait()
        plans = [one for host, one in sorted(self._plans.items()) if host in self._stopping]
        if unfit := ", ".join(one.host for one in plans if self._check(one).problem):
            raise HostError(Kind.HELD, f"nothing was changed, since {unfit} cannot run its part")

    def _wait(self) -> None:
        with self._changed:
            self._changed.wait_for(lambda: not self._missing)


def refused(problem: Problem) -> HostError:
    """The error of an unfit host."""
    return HostError(Kind.UNFIT, problem.message, problem.hint)
