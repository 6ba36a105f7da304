"""The change of one host, from the operator's side: applied on one connection, confirmed over a new one.

A host whose change is not confirmed goes back by itself: a release that locks its operator out does not stay.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Literal

from swarm_agent.messages import ApplyRequest, ConfirmRequest, HoldRequest, UnitState

from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan, Kind
from swarmctl.remote import agent_client
from swarmctl.remote.agent_client import Conversation
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.transport import HostError
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.render.bundle import Bundle

APPLY_TIMEOUT = 300.0  # s; the agent's own steps are bounded, and this is above their sum
_LOCK_WAIT = 60.0  # s; what the agent waits at most for an agent whose connection was lost
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
    """The change of one host to ``bundle``.

    ``first``: the connection on which it was observed; ``again`` opens a new one, unless ``stop`` is cut.
    """

    bundle: Bundle
    first: Conversation
    again: Callable[[], AbstractContextManager[Conversation]]
    stop: Stop
    terms: Terms
    note: Callable[[str], None]

    def settle(self, observed: Observed) -> bool:
        """Finishes what an earlier deploy left open: the same release is confirmed, another one undone.

        Returns False if nothing was open. Raises ``HostError`` if another operator's change waits.
        """
        last = observed.transaction
        if last is None or not observed.unfinished:
            return False
        if last["left"] and last["next"] == self.bundle.digest:
            self.note("confirming what an earlier run has applied")
            self._hold_and_confirm(self.first, last["txid"])
            return True
        if last["left"] and not _ours(last["who"]):
            raise HostError(
                ErrorKind.REFUSED,
                f"locked by {last['who']}, whose deploy waits for its confirmation",
                f"run the same command again; it is confirmed or undone within {last['left']:.0f} s",
            )
        self.note("undoing what an earlier deploy has left")
        self.first.ask(self._decision("undo", last["txid"]), on_note=self.note, timeout=APPLY_TIMEOUT)
        return True

    def commit(self, plan: HostPlan, kept: Collection[str]) -> Mapping[str, UnitState]:
        """Has the host execute the plan, and confirms it. Returns the states of its units.

        Files whose digest is ``kept`` are not sent. Raises ``HostError`` if the change does not stay.
        """
        txid = agent_client.new_txid()
        lost = None
        try:
            self._apply(txid, plan, kept)
        except HostError as error:
            if error.kind not in (ErrorKind.LOST, ErrorKind.PROTOCOL):
                raise
            lost = error  # the agent may have begun, and goes on
        try:
            return self._confirmed(txid)
        except HostError as error:
            raise (lost if lost and error.kind is ErrorKind.REFUSED else error) from error

    def _apply(self, txid: str, plan: HostPlan, kept: Collection[str]) -> None:
        request: ApplyRequest = {
            "verb": "apply",
            "swarm": self.bundle.swarm,
            "txid": txid,
            "who": agent_client.operator(),
            "base": plan.base,
            "next": plan.next,
            "stop": list(plan.targets(Kind.STOP)),
            "start": list(plan.targets(Kind.START)),
            "restart": list(plan.targets(Kind.RESTART)),
            "reload": list(plan.targets(Kind.RELOAD)),
            "confirm_within": self.terms.confirm_within,
        }
        payload = agent_client.pack(
            self.bundle.manifest_bytes,
            {file.path: (file.content, file.mode) for file in self.bundle.files if file.digest not in kept},
        )
        self.first.ask(request, payload, on_note=self.note, timeout=APPLY_TIMEOUT)

    def _confirmed(self, txid: str) -> Mapping[str, UnitState]:
        """Confirms over a new connection, which is tried until the host has gone back by itself."""
        begun = time.monotonic()
        while True:
            try:
                with self.again() as host:
                    return self._hold_and_confirm(host, txid)
            except HostError as error:
                waited = time.monotonic() - begun
                if error.kind not in _RETRIED or self.stop.cut:
                    raise
                if waited > self.terms.confirm_within + _GRACE:
                    raise self._cut_off(error) from error
                self.note(f"no new connection since the change, for {waited:.0f} s: {error}")
            time.sleep(_AGAIN)

    def _cut_off(self, error: HostError) -> HostError:
        return HostError(
            ErrorKind.LOST,
            f"it was changed and does not answer since: {error}; without a confirmation it goes back to its "
            f"earlier release by itself, {self.terms.confirm_within:g} s after the change",
            error.hint or "`swarmctl plan` shows the result once it answers",
        )

    def _hold_and_confirm(self, host: Conversation, txid: str) -> Mapping[str, UnitState]:
        request: HoldRequest = {
            "verb": "hold",
            "swarm": self.bundle.swarm,
            "txid": txid,
            "who": agent_client.operator(),
            "wait": _LOCK_WAIT,
            "seconds": self.terms.healthy_for,
            "within": self.terms.healthy_within,
        }
        held = host.ask(request, on_note=self.note, timeout=APPLY_TIMEOUT)
        stays = host.ask(self._decision("confirm", txid), timeout=2 * _LOCK_WAIT)["release"]
        if stays != self.bundle.digest:
            raise HostError(
                ErrorKind.PROTOCOL,
                f"it confirms release {stays or 'none'}, and {self.bundle.digest} was applied",
                "is it the right host, and its agent intact?",
            )
        units: Mapping[str, UnitState] = held["units"]
        return units

    def _decision(self, verb: Literal["confirm", "undo"], txid: str) -> ConfirmRequest:
        return {
            "verb": verb,
            "swarm": self.bundle.swarm,
            "txid": txid,
            "who": agent_client.operator(),
            "wait": _LOCK_WAIT,
        }


def _ours(who: str) -> bool:
    """True if ``who`` is this operator on this machine, in a run that has ended."""
    person, _, process = who.rpartition(" (")
    number = process.rstrip(")")
    if person != agent_client.operator().rpartition(" (")[0] or not number.isdecimal():
        return False
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return int(number) == os.getpid()
