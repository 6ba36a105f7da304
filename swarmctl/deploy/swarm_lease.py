"""The lease of a swarm: of several runs at once, one changes its hosts, and the others report who has it.

The first host in the order of names that answers decides: the others get the request only once it has given
its lease. So runs on the same hosts never end with a part of them each.
"""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from types import TracebackType

from swarm_onboard.agent.lease import SECONDS
from swarm_onboard.agent.verbs import lease

from swarmctl.plan.observed_host import Observed
from swarmctl.remote import agent_client, operators, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.connections import Connections
from swarmctl.remote.parallel_hosts import Finished, Stop
from swarmctl.remote.transport import AgentSession, HostError, Kind, Target

_RENEWED_EACH = SECONDS / 3  # s
_ATTEMPTS = 2  # of runs on different hosts each may refuse the other


class SwarmLease:
    """The leases of this run on ``hosts``. Use it as a context manager: it gives them back in the end."""

    def __init__(self, swarm: str, connections: Connections, *, parallel: int, stop: Stop) -> None:
        self.run = agent_client.new_txid()
        self._swarm = swarm
        self._connections = connections
        self._parallel = parallel
        self._stop = stop
        self._held: dict[str, Target] = {}
        self._pending: dict[str, tuple[str, float]] = {}
        self._ended = threading.Event()
        self._renewing: threading.Thread | None = None

    def __enter__(self) -> SwarmLease:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        if self._renewing is not None:
            self._renewing.join()
        self._give_back()

    def take(self, targets: Iterable[Target], seen: Mapping[str, Observed]) -> Mapping[str, HostError]:
        """Takes the lease of every target, or of none. Returns the errors of those that do not give it.

        ``seen``: each host when its plan was made. One that was changed since, or whose change had not ended
        then, refuses. A host that is away refuses nothing.
        """
        for attempt in range(_ATTEMPTS):
            errors = self._requested_of(sorted(targets, key=lambda one: one.host), seen)
            refused = any(error.kind is Kind.REFUSED for error in errors.values())
            if not refused:
                self._renewing = threading.Thread(target=self._renew, daemon=True)
                self._renewing.start()
                return errors
            self._give_back()
            if attempt + 1 < _ATTEMPTS:
                time.sleep(random.uniform(0.05, 0.3))
        return errors

    def waits(self, host: str, txid: str, confirm_within: float) -> None:
        """Has the change ``txid`` of a host wait, with each renewal ``confirm_within`` s longer."""
        self._pending[host] = txid, confirm_within

    def decided(self, host: str) -> None:
        """Ends that."""
        self._pending.pop(host, None)

    def _requested_of(self, targets: list[Target], seen: Mapping[str, Observed]) -> dict[str, HostError]:
        errors: dict[str, HostError] = {}
        while targets:  # one by one, until the first gives it
            first, *targets = targets
            errors |= self._each_gives([first], seen)
            if first.host in self._held or errors[first.host].kind is Kind.REFUSED:
                break
        if not self._held:
            return errors
        return errors | self._each_gives(targets, seen)

    def _each_gives(self, targets: list[Target], seen: Mapping[str, Observed]) -> dict[str, HostError]:
        errors: dict[str, HostError] = {}

        def work(target: Target, note: object) -> None:
            try:
                with self._connections.agent_session(target) as host:
                    self._ask(host, target, seen)
            except HostError as error:
                if error.kind not in (Kind.LOST, Kind.UNREACHABLE):
                    raise
                with self._connections.agent_session(
                    target, anew=True
                ) as host:  # a kept one may have died meanwhile
                    self._ask(host, target, seen)

        for event in parallel_hosts.each(targets, work, parallel=self._parallel, stop=self._stop):
            if isinstance(event, Finished) and isinstance(found := event.outcome, HostError):
                errors[event.host] = found
        return errors

    def _ask(self, host: AgentSession, target: Target, seen: Mapping[str, Observed]) -> None:
        request = self._request(want=True)
        answer = ask(host, lease.handle, request)
        if not answer.granted and operators.ended_here(answer.who):
            answer = ask(host, lease.handle, request._replace(breaks=answer.run))
        if not answer.granted:
            raise HostError(
                Kind.REFUSED,
                f"locked by {answer.who}",
                "wait until that deploy has ended, then run the same command again",
            )
        self._held[target.host] = target
        observed = seen[target.host]
        if observed.unfinished or answer.last != observed.last_txid:
            by = f", by {answer.last_who}" if answer.last_who else ""
            raise HostError(
                Kind.REFUSED,
                f"another deploy has changed it since the plan was made{by}",
                "run the same command again",
            )

    def _request(self, *, want: bool) -> lease.Request:
        return lease.Request(self._swarm, self.run, want, who=operators.this_one(), wait=1.0)

    def _renew(self) -> None:
        while not self._ended.wait(_RENEWED_EACH):
            self._each_held(self._renewed)

    def _renewed(self, target: Target, note: object) -> None:
        request = self._request(want=True)
        if target.host in self._pending:
            txid, seconds = self._pending[target.host]
            request = request._replace(pending=txid, confirm_within=seconds)
        with self._connections.idle(target) as host:
            if host is not None:  # one at work renews it with each change
                ask(host, lease.handle, request)

    def _give_back(self) -> None:
        """Ends the leases. One that cannot be given back ends by itself."""

        def work(target: Target, note: object) -> None:
            with self._connections.idle(target) as host:
                if host is not None:
                    ask(host, lease.handle, self._request(want=False))

        self._each_held(work)
        self._held.clear()

    def _each_held(self, work: Callable[[Target, object], None]) -> None:
        """Does the work for every host with a lease. Their errors show with the next request."""
        for _ in parallel_hosts.each(list(self._held.values()), work, parallel=self._parallel, stop=Stop()):
            pass
