"""The change of one host, from the operator's side: applied, and confirmed after a new login.

A host whose change is not confirmed rolls back automatically: a release that locks its operator out does
not stay.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from typing import TypeVar

from swarm_onboard.agent.record import REMOVING
from swarm_onboard.agent.steps import TAKEN, Kind
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.transaction import Applied
from swarm_onboard.agent.verbs import apply, confirm, hold, undo

from swarmctl.deploy.observe_host import offer
from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan
from swarmctl.remote import agent_client, operators
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.transport import AgentSession, HostError
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.render.bundle import Bundle

R = TypeVar("R")
_LOCK_WAIT = 60.0  # s; what the agent waits at most for an agent whose connection was lost
_OTHERS_WAIT = 1.0  # s; for a lock that another operator holds
_AGAIN = 1.0  # s between attempts to connect
_GRACE = 15.0  # s after the deadline in which a host that went back should answer again
_LATE = 2.0  # s; a new login that took longer is named in the error of a change that did not stay
_RETRIED = (ErrorKind.UNREACHABLE, ErrorKind.LOST, ErrorKind.AUTH, ErrorKind.HOST_KEY, ErrorKind.PRIVILEGE)


@dataclass(frozen=True)
class Terms:
    """What a change must show before it stays, in s.

    Its units run ``healthy_for`` without a restart, at the latest after ``healthy_within``; without a
    confirmation the host undoes it after ``confirm_within``.
    """

    healthy_for: float = 6.0
    healthy_within: float = 30.0
    confirm_within: float = 60.0


@dataclass(frozen=True)
class HostTransaction:
    """The change of one host to ``bundle`` by the ``run`` that has its lease.

    ``connect`` opens a connection, a new one if its argument is true, unless ``stop`` is cut; ``log_in``
    opens one beside that in use, runs a command over it and closes it. ``secrets``: the values that the
    operator has.
    """

    bundle: Bundle
    run: str
    connect: Callable[[bool], AbstractContextManager[AgentSession]]
    log_in: Callable[[], None]
    stop: Stop
    terms: Terms
    note: Callable[[str], None]
    stop_robots: bool = False
    secrets: Mapping[str, str] = field(default_factory=dict, repr=False)
    issued: float = 0.0

    @property
    def release(self) -> str:
        """The digest of the release that the host should have."""
        return self.bundle.digest

    def recover_interrupted(self, host: AgentSession, observed: Observed) -> bool:
        """Finishes what an earlier deploy left open: the same release is confirmed, another one undone.

        Returns False if nothing was open. Raises ``HostError`` if another operator's change waits, or a
        removal is not finished.
        """
        last = observed.transaction
        if last is None or not observed.unfinished:
            return False
        if last.state == REMOVING:
            raise HostError(
                ErrorKind.REFUSED,
                observed.unfinished,
                "run the same command again once it is; `swarmctl remove` finishes an interrupted one",
            )
        if last.left and not _ours(last.who):
            raise HostError(
                ErrorKind.REFUSED,
                f"locked by {last.who}, whose deploy waits for its confirmation",
                f"run the same command again; it is confirmed or undone within {last.left:.0f} s",
            )
        if last.left and last.next == self.release:
            self.note("confirming what an earlier run has applied")
            self._hold(host, last.txid)
            self.log_in()
            self._confirm(host, last.txid)
            return True
        # An agent whose connection this operator has lost may still be at work; another operator's is not.
        patience = _LOCK_WAIT if _ours(last.who) else _OTHERS_WAIT
        self.note("undoing what an earlier deploy has left")
        self._undo(host, last.txid, pending=bool(last.left), wait=patience)
        return True

    def commit(self, host: AgentSession, plan: HostPlan, kept: Collection[str]) -> Mapping[str, UnitState]:
        """Has the host execute the plan, and confirms it. Returns the states of its units.

        A change of files alone stays without a confirmation, and no units are looked at. Files whose digest
        is ``kept`` are not sent. Raises ``HostError`` if the change does not stay.
        """
        if plan.files_only:
            self._switch(host, plan, kept)
            return {}
        txid, units = self.change(host, plan, kept)
        self.confirm(txid, host)
        return units

    def change(
        self, host: AgentSession, plan: HostPlan, kept: Collection[str]
    ) -> tuple[str, Mapping[str, UnitState]]:
        """As ``commit``, but any change waits for its confirmation. Returns its name, and the units."""
        plan = replace(plan, files_only=False)
        txid = agent_client.new_txid()
        lost = None
        try:
            self._apply(host, txid, plan, kept)
        except HostError as error:
            if error.kind not in (ErrorKind.LOST, ErrorKind.PROTOCOL):
                raise
            lost = error  # the agent may have begun, and goes on

        def held(host: AgentSession) -> Mapping[str, UnitState]:
            return self._hold(host, txid)

        try:
            return txid, self._reached(held, first=None if lost else lambda: held(host))
        except HostError as error:
            raise (lost if lost and error.kind is ErrorKind.REFUSED else error) from error

    def confirm(self, txid: str, host: AgentSession | None = None) -> None:
        """Confirms a change whose units keep running, once a new login has shown that the host lets us in.

        ``host``: the session in which it was made, if that is still in use. Raises ``HostError`` if the
        change does not stay.
        """
        begun = time.monotonic()

        def confirmed(host: AgentSession) -> None:
            self.log_in()  # after the units have kept running: what locks us out may take some s to begin
            waited = time.monotonic() - begun
            try:
                self._confirm(host, txid)
            except HostError as error:
                if error.kind is not ErrorKind.FAILED or waited < _LATE:
                    raise
                raise _explained(error, waited) from error

        self._reached(confirmed, first=(lambda: confirmed(host)) if host else None, anew=False)

    def undo(self, txid: str) -> None:
        """Undoes a change that waits for its confirmation. Raises ``HostError``."""
        self._reached(lambda host: self._undo(host, txid), anew=False)

    def _switch(self, host: AgentSession, plan: HostPlan, kept: Collection[str]) -> None:
        """Has the host execute a change of files alone; a new connection shows the result of a lost one."""
        txid = agent_client.new_txid()
        try:
            self._check(self._apply(host, txid, plan, kept).release)
        except HostError as lost:
            if lost.kind not in (ErrorKind.LOST, ErrorKind.PROTOCOL):
                raise
            try:
                self._reached(lambda host: self._confirm(host, txid))
            except HostError as error:
                raise (lost if error.kind is ErrorKind.REFUSED else error) from error

    def _apply(self, host: AgentSession, txid: str, plan: HostPlan, kept: Collection[str]) -> Applied:
        due = plan.targets(Kind.SECRET)
        values = offer(due, self.secrets) if due else b""
        request = apply.Request(
            self.bundle.swarm,
            txid,
            plan.previous,
            plan.next,
            steps=[step for step in plan.steps if step.kind in TAKEN],
            confirm_within=0.0 if plan.files_only else self.terms.confirm_within,
            secrets=len(values),
            files_only=plan.files_only,
            wireguard_keys=self.bundle.wireguard_keys if plan.targets(Kind.KEY) else "",
            who=operators.this_one(),
            run=self.run,
            stop_robots=self.stop_robots,
            issued=self.issued,
        )
        archive = agent_client.pack(
            self.bundle.manifest_bytes,
            {file.path: (file.content, file.mode) for file in self.bundle.files if file.digest not in kept},
        )
        return ask(
            host, apply.handle, request, values + archive,
            on_note=self.note, timeout=agent_client.CHANGE_TIMEOUT,
        )  # fmt: skip

    def _reached(
        self, work: Callable[[AgentSession], R], *, first: Callable[[], R] | None = None, anew: bool = True
    ) -> R:
        """Does the work over a new connection, which is tried until the host has gone back by itself.

        ``first`` is the same work over the connection in use, and is tried before. Without ``anew`` a kept
        connection does for the first attempt.
        """
        begun, noted = time.monotonic(), 0.0
        if first is not None:
            try:
                return first()
            except HostError as error:
                if error.kind not in (*_RETRIED, ErrorKind.PROTOCOL) or self.stop.cut:
                    raise
        while True:
            try:
                with self.connect(anew) as host:
                    return work(host)
            except HostError as error:
                waited = time.monotonic() - begun
                if error.kind not in _RETRIED or self.stop.cut:
                    raise
                if waited > self.terms.confirm_within + _GRACE:
                    raise self._cut_off(error) from error
                if anew and waited >= noted:
                    self.note(f"no new connection since the change, for {waited:.0f} s: {error}")
                    noted = 2 * waited
            anew = True
            time.sleep(_AGAIN)

    def _cut_off(self, error: HostError) -> HostError:
        return HostError(
            ErrorKind.LOST,
            f"it was changed and does not answer since: {error}; without a confirmation it goes back to its "
            f"earlier release by itself, {self.terms.confirm_within:g} s after the change",
            error.hint or "`swarmctl plan` shows the result once it answers",
        )

    def _hold(self, host: AgentSession, txid: str) -> Mapping[str, UnitState]:
        request = hold.Request(
            self.bundle.swarm,
            txid,
            self.terms.healthy_for,
            self.terms.healthy_within,
            who=operators.this_one(),
            wait=_LOCK_WAIT,
        )
        return ask(host, hold.handle, request, on_note=self.note, timeout=agent_client.CHANGE_TIMEOUT).units

    def _confirm(self, host: AgentSession, txid: str) -> None:
        request = confirm.Request(self.bundle.swarm, txid, who=operators.this_one(), wait=_LOCK_WAIT)
        self._check(ask(host, confirm.handle, request, timeout=2 * _LOCK_WAIT).release)

    def _check(self, stays: str | None) -> None:
        """Raises ``HostError`` if the release that stays is another one."""
        if stays != self.release:
            raise HostError(
                ErrorKind.PROTOCOL,
                f"it confirms release {stays or 'none'}, and {self.release} was applied",
                "is it the right host, and its agent intact?",
            )

    def _undo(self, host: AgentSession, txid: str, *, pending: bool = True, wait: float = _LOCK_WAIT) -> None:
        request = undo.Request(self.bundle.swarm, txid, pending, who=operators.this_one(), wait=wait)
        ask(host, undo.handle, request, on_note=self.note, timeout=agent_client.CHANGE_TIMEOUT)


def _explained(error: HostError, waited: float) -> HostError:
    """The error of a change that did not stay, with the s that passed without a new login."""
    return HostError(error.kind, f"{error.message}; it took no new connection for {waited:.0f} s", error.hint)


def _ours(who: str) -> bool:
    """True if ``who`` is this run, or one of this operator on this machine that has ended."""
    return who == operators.this_one() or operators.ended_here(who)
