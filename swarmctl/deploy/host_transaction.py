"""The change of one host, from the operator's side: applied on one connection, confirmed over a new one.

A host whose change is not confirmed goes back by itself: a release that locks its operator out does not stay.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from swarm_agent.messages import ApplyRequest, ConfirmRequest, HoldRequest, UnitState

from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan, Kind
from swarmctl.remote import agent_client, operators
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.transport import Conversation, HostError
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.render.bundle import Bundle

R = TypeVar("R")
APPLY_TIMEOUT = 300.0  # s; the agent's own steps are bounded, and this is above their sum
_LOCK_WAIT = 60.0  # s; what the agent waits at most for an agent whose connection was lost
_OTHERS_WAIT = 1.0  # s; for a lock that another operator holds
_AGAIN = 1.0  # s between attempts to connect
_GRACE = 15.0  # s after the deadline in which a host that went back should answer again
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

    ``connect`` opens a connection, a new one if its argument is true, unless ``stop`` is cut.
    """

    bundle: Bundle
    run: str
    connect: Callable[[bool], AbstractContextManager[Conversation]]
    stop: Stop
    terms: Terms
    note: Callable[[str], None]
    stop_robots: bool = False

    @property
    def release(self) -> str:
        """The digest of the release that the host should have."""
        return self.bundle.digest

    def settle(self, host: Conversation, observed: Observed) -> bool:
        """Finishes what an earlier deploy left open: the same release is confirmed, another one undone.

        Returns False if nothing was open. Raises ``HostError`` if another operator's change waits.
        """
        last = observed.transaction
        if last is None or not observed.unfinished:
            return False
        if last["left"] and last["next"] == self.release:
            self.note("confirming what an earlier run has applied")
            self._hold(host, last["txid"])
            self._confirm(host, last["txid"])
            return True
        if last["left"] and not _ours(last["who"]):
            raise HostError(
                ErrorKind.REFUSED,
                f"locked by {last['who']}, whose deploy waits for its confirmation",
                f"run the same command again; it is confirmed or undone within {last['left']:.0f} s",
            )
        # An agent whose connection this operator has lost may still be at work; another operator's is not.
        patience = _LOCK_WAIT if _ours(last["who"]) else _OTHERS_WAIT
        self.note("undoing what an earlier deploy has left")
        self._undo(host, last["txid"], pending=bool(last["left"]), wait=patience)
        return True

    def commit(self, host: Conversation, plan: HostPlan, kept: Collection[str]) -> Mapping[str, UnitState]:
        """Has the host execute the plan, and confirms it. Returns the states of its units.

        Files whose digest is ``kept`` are not sent. Raises ``HostError`` if the change does not stay.
        """
        txid, units = self.change(host, plan, kept)
        self.confirm(txid)
        return units

    def change(
        self, host: Conversation, plan: HostPlan, kept: Collection[str]
    ) -> tuple[str, Mapping[str, UnitState]]:
        """As ``commit``, but the change waits for its confirmation. Returns its name, and the units."""
        txid = agent_client.new_txid()
        lost = None
        try:
            self._apply(host, txid, plan, kept)
        except HostError as error:
            if error.kind not in (ErrorKind.LOST, ErrorKind.PROTOCOL):
                raise
            lost = error  # the agent may have begun, and goes on
        try:
            return txid, self._reached(lambda new: self._hold(new, txid))
        except HostError as error:
            raise (lost if lost and error.kind is ErrorKind.REFUSED else error) from error

    def confirm(self, txid: str) -> None:
        """Confirms a change whose units keep running. Raises ``HostError`` if it does not stay."""
        self._reached(lambda host: self._confirm(host, txid), anew=False)

    def undo(self, txid: str) -> None:
        """Undoes a change that waits for its confirmation. Raises ``HostError``."""
        self._reached(lambda host: self._undo(host, txid), anew=False)

    def _apply(self, host: Conversation, txid: str, plan: HostPlan, kept: Collection[str]) -> None:
        request: ApplyRequest = {
            "verb": "apply",
            "swarm": self.bundle.swarm,
            "txid": txid,
            "who": operators.this_one(),
            "run": self.run,
            "base": plan.base,
            "next": plan.next,
            "stop": list(plan.targets(Kind.STOP)),
            "start": list(plan.targets(Kind.START)),
            "restart": list(plan.targets(Kind.RESTART)),
            "reload": list(plan.targets(Kind.RELOAD)),
            "confirm_within": self.terms.confirm_within,
            "stop_robots": self.stop_robots,
        }
        payload = agent_client.pack(
            self.bundle.manifest_bytes,
            {file.path: (file.content, file.mode) for file in self.bundle.files if file.digest not in kept},
        )
        self._ask(host, request, payload)

    def _ask(self, host: Conversation, request: Mapping[str, Any], payload: bytes = b"") -> None:
        host.ask(request, payload, on_note=self.note, timeout=APPLY_TIMEOUT)

    def _reached(self, work: Callable[[Conversation], R], *, anew: bool = True) -> R:
        """Does the work over a new connection, which is tried until the host has gone back by itself.

        Without ``anew`` a kept connection does for the first attempt.
        """
        begun = time.monotonic()
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
                if anew:
                    self.note(f"no new connection since the change, for {waited:.0f} s: {error}")
            anew = True
            time.sleep(_AGAIN)

    def _cut_off(self, error: HostError) -> HostError:
        return HostError(
            ErrorKind.LOST,
            f"it was changed and does not answer since: {error}; without a confirmation it goes back to its "
            f"earlier release by itself, {self.terms.confirm_within:g} s after the change",
            error.hint or "`swarmctl plan` shows the result once it answers",
        )

    def _hold(self, host: Conversation, txid: str) -> Mapping[str, UnitState]:
        request: HoldRequest = {
            "verb": "hold",
            "swarm": self.bundle.swarm,
            "txid": txid,
            "who": operators.this_one(),
            "wait": _LOCK_WAIT,
            "seconds": self.terms.healthy_for,
            "within": self.terms.healthy_within,
        }
        units: Mapping[str, UnitState] = host.ask(request, on_note=self.note, timeout=APPLY_TIMEOUT)["units"]
        return units

    def _confirm(self, host: Conversation, txid: str) -> None:
        stays = host.ask(self._decision("confirm", txid), timeout=2 * _LOCK_WAIT)["release"]
        if stays != self.release:
            raise HostError(
                ErrorKind.PROTOCOL,
                f"it confirms release {stays or 'none'}, and {self.release} was applied",
                "is it the right host, and its agent intact?",
            )

    def _undo(self, host: Conversation, txid: str, *, pending: bool = True, wait: float = _LOCK_WAIT) -> None:
        request: ConfirmRequest = {**self._decision("undo", txid), "pending": pending, "wait": wait}
        host.ask(request, on_note=self.note, timeout=APPLY_TIMEOUT)

    def _decision(self, verb: Literal["confirm", "undo"], txid: str) -> ConfirmRequest:
        return {
            "verb": verb,
            "swarm": self.bundle.swarm,
            "txid": txid,
            "who": operators.this_one(),
            "wait": _LOCK_WAIT,
        }


def _ours(who: str) -> bool:
    """True if ``who`` is this run, or one of this operator on this machine that has ended."""
    return who == operators.this_one() or operators.ended_here(who)
