"""Runs one task per peer and one for the own master. A peer that fails affects only its own task."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import time
from dataclasses import replace
from typing import Callable, Sequence

from swarm_onboard.common.xmlrpc import NonsenseError, PeerError, within
from swarm_onboard.multimaster import peer_state as contacts
from swarm_onboard.multimaster import reconcile
from swarm_onboard.multimaster.config import Config, Peer
from swarm_onboard.multimaster.diagnostics import TOPIC, TYPE, Status, status_of
from swarm_onboard.multimaster.graph import RECORD, Entry, Graph, Record
from swarm_onboard.multimaster.master import Master
from swarm_onboard.multimaster.peer_state import Contact, Offer, Refusal, State
from swarm_onboard.multimaster.rpc import Call

_PATIENCE = 10.0  # s until a peer that returned an invalid reply is polled again
_SHORTEST_WAIT = 0.1  # s between two polls of a peer, however often it calls
_ROUNDS = 8  # of polling and calling, until the own master matches the plan


class Bridge:
    """Registers what the peers offer at the own master. ``uri``: this node's slave API."""

    def __init__(self, config: Config, uri: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.config, self._uri, self._clock = config, uri, clock
        self._types = reconcile.types_of(config)
        self._own = Master(config.master, config.node)
        self._masters = {
            peer.island: Master(peer.master, config.node, peer.receives) for peer in config.peers
        }
        self._wakes = {peer.island: asyncio.Event() for peer in config.peers}
        self._news = asyncio.Event()
        self._brought: dict[Entry, str] | None = None  # None until the own master has answered
        self._former: dict[str, asyncio.Future[None]] = {}  # masters of an earlier configuration
        self._problem = State.WAITING.value
        self._refusals: tuple[Refusal, ...] = ()
        self._contacts = {peer.island: Contact(clock()) for peer in config.peers}

    async def run(self) -> None:
        """Runs until cancelled."""
        await asyncio.gather(self._tend_own(), *(self._tend(peer) for peer in self.config.peers))

    def wake(self, topic: str) -> None:
        """A master reports that the publishers of ``topic`` changed: polls the peers concerned at once."""
        for peer in self.config.peers:
            if topic in peer.receives:
                self._wakes[peer.island].set()

    def status(self) -> Status:
        """Returns the state of all peers and the refused topics."""
        offers = (refusal for one in self._contacts.values() for refusal in one.offer.refusals)
        refusals = (*offers, *self._refusals)
        return status_of(self.config, self._contacts, self._problem, refusals, self._clock())

    async def _tend(self, peer: Peer) -> None:
        while True:
            patience = await self.visit(peer)
            await asyncio.sleep(_SHORTEST_WAIT)
            await _within(patience, self._wakes[peer.island])

    async def visit(self, peer: Peer) -> float:
        """Polls a peer once; returns the seconds until it should be polled again."""
        try:
            offer = await self._poll(peer)
        except PeerError as error:
            self._change(peer, contacts.missed(self._contacts[peer.island], str(error)))
            return _PATIENCE if isinstance(error, NonsenseError) else self.config.period
        one = self._contacts[peer.island]
        self._change(peer, contacts.met(one, offer, self._clock(), self.config.silent_after))
        return self.config.period

    async def _poll(self, peer: Peer) -> Offer:
        """Returns what the peer offers now; subscribes at its master, so that it reports changes."""
        master, me = self._masters[peer.island], self.config.node
        graph = await master.look(lambda seen: reconcile.names_wanted(peer, seen))
        missing, extra = reconcile.subscriptions(peer, graph, me, self._uri)
        calls: list[Call] = [("unregisterSubscriber", me, topic, uri) for topic, uri in extra]
        calls += [("registerSubscriber", me, topic, peer.receives[topic], self._uri) for topic in missing]
        await master.do(calls)
        return reconcile.offer_of(peer, graph)

    def _change(self, peer: Peer, now: Contact) -> None:
        before, self._contacts[peer.island] = self._contacts[peer.island], now
        if before.offer.entries != now.offer.entries or before.healed != now.healed:
            self._news.set()
        if before.offer.refusals != now.offer.refusals:
            _log_refusals(peer.island, now.offer.refusals)
        if (before.last_seen is None, before.problem) != (now.last_seen is None, now.problem):
            _log(f"island {peer.island}: {now.problem or State.CONNECTED.value}")

    async def _tend_own(self) -> None:
        while True:
            await self.settle()
            await _within(self.config.period, self._news)

    async def settle(self) -> None:
        """Brings the own master to the wanted state; records the problem if that fails."""
        problem = ""
        try:
            await self._settle()
        except PeerError as error:
            problem = str(error)
        if problem != self._problem:
            _log(f"own master: {problem or State.CONNECTED.value}")
        self._problem = problem

    async def _settle(self) -> None:
        """Polls the own master and makes the missing calls, until none is missing."""
        now = self._clock()
        due = frozenset(name for name, one in self._contacts.items() if contacts.renewal_due(one, now))
        for _ in range(_ROUNDS):
            own = await self._own.look(lambda seen: self._names_wanted_here(seen.record))
            if self._brought is None:
                self._take_over(own.record)
            calls = self._missing_at(own, due)
            if not calls:
                return
            if any(code != 1 for code, _ in await self._own.do(calls)):
                raise PeerError("it refused a registration")
            for name in due:
                self._contacts[name] = contacts.renewed(self._contacts[name], now)
            due = frozenset()

    def _names_wanted_here(self, record: Record) -> frozenset[str]:
        brought = record.entries if self._brought is None else self._brought
        offered = (entry for one in self._contacts.values() for entry in one.offer.entries)
        return frozenset(entry.node for entry in (*brought, *offered))

    def _take_over(self, record: Record) -> None:
        """Takes over an earlier run's registrations, until their peer answers or is away too long.

        Anybody can write the record: only nodes on hosts of the peers are taken over, and may be removed.
        """
        self._brought = {}
        for peer in self.config.peers:
            one = self._contacts[peer.island]
            left = {entry for entry in record.entries if reconcile.runs_on(peer, entry)}
            self._brought.update(dict.fromkeys(left, peer.island))
            if one.last_seen is None:
                kept = frozenset(entry for entry in left if reconcile.may_come(peer, entry))
                self._contacts[peer.island] = replace(one, offer=Offer(kept))
        for uri in record.masters - {peer.master for peer in self.config.peers}:
            self._former[uri] = asyncio.ensure_future(self._leave_former(uri))

    def _missing_at(self, own: Graph, due: frozenset[str]) -> list[Call]:
        """Returns the missing calls to the own master, in order."""
        me, now, brought = self.config.node, self._clock(), self._brought or {}
        offers = [(name, contacts.offered_by(one, now, self.config)) for name, one in self._contacts.items()]
        wanted, clashes = reconcile.wanted_from(offers, brought)
        renew = {entry for entry, island in wanted.items() if island in due}
        plan = reconcile.plan_for(wanted, own, brought, renew)
        self._brought = dict(plan.brought)
        self._refuse((*clashes, *plan.refusals))
        record = Record(
            plan.brought, frozenset((*self._former, *(peer.master for peer in self.config.peers)))
        )
        calls: list[Call] = [] if own.record == record else [("setParam", me, RECORD, record.packed())]
        calls += [("unregisterPublisher", one.node, one.topic, one.uri) for one in plan.drop]
        calls += [
            ("registerPublisher", one.node, one.topic, self._types[one.topic], one.uri) for one in plan.add
        ]
        if (TOPIC, me) not in own.publishers or own.nodes.get(me) != self._uri:
            calls.append(("registerPublisher", me, TOPIC, TYPE, self._uri))
        return calls

    def _refuse(self, refusals: tuple[Refusal, ...]) -> None:
        if refusals != self._refusals:
            _log_refusals(self.config.island, refusals)
        self._refusals = refusals

    async def _leave_former(self, uri: str) -> None:
        """Unsubscribes at a master that only an earlier configuration lists; retries for ``remove_after``."""
        end, master = self._clock() + self.config.remove_after, Master(uri, self.config.node)
        while self._clock() < end:
            try:
                await self._leave(master)
                break
            except PeerError:
                await asyncio.sleep(_PATIENCE)
        del self._former[uri]

    async def _leave(self, master: Master) -> None:
        me = self.config.node
        graph = await master.look(lambda seen: frozenset())
        uri = graph.nodes.get(me, self._uri)
        await master.do([("unregisterSubscriber", me, topic, uri) for topic in sorted(graph.subscribed)])

    async def unregister_all(self) -> None:
        """Removes all registrations of this node; waits for a hanging master as long as three calls take."""
        me = self.config.node
        calls: list[Call] = [
            ("unregisterPublisher", one.node, one.topic, one.uri) for one in self._brought or ()
        ]
        calls += [("unregisterPublisher", me, TOPIC, self._uri)]
        calls += [] if self._brought is None else [("deleteParam", me, RECORD)]
        leaving = [self._own.do(calls), *(self._leave(master) for master in self._masters.values())]
        await asyncio.gather(*leaving, return_exceptions=True)


async def _within(seconds: float, event: asyncio.Event) -> None:
    """Waits until ``event`` is set, for ``seconds`` at most; clears it."""
    with contextlib.suppress(asyncio.TimeoutError):
        await within(seconds, event.wait())
    event.clear()


def _log(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _log_refusals(island: str, refusals: Sequence[Refusal]) -> None:
    for one in refusals:
        _log(f"island {island}: {one.topic} of {one.node} refused: {one.why}")
