"""An island of ROS 1, seen from one of ROS 2: what comes from it, and what goes there."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any, Callable, Collection

from swarm_onboard.common import slave
from swarm_onboard.common.xmlrpc import PeerError, within
from swarm_onboard.domain_relay import registrations
from swarm_onboard.domain_relay.config import Config, Crossing, Ros1Peer
from swarm_onboard.domain_relay.domains import Home
from swarm_onboard.domain_relay.peer_state import PeerState
from swarm_onboard.domain_relay.publishers import Quality
from swarm_onboard.domain_relay.ros1_arrivals import Arrivals
from swarm_onboard.domain_relay.ros1_publisher import Nodes, Outgoing
from swarm_onboard.multimaster import config as multimaster
from swarm_onboard.multimaster import reconcile
from swarm_onboard.multimaster.graph import Entry, Graph
from swarm_onboard.multimaster.master import Master
from swarm_onboard.multimaster.rpc import Call
from swarm_onboard.ros2.board_types import md5sum_and_least

_PERIOD = 1.0  # s between two looks at the master
_SHORTEST_WAIT = 0.1  # s, however often the master calls
_ROUNDS = 4  # of looking and calling, until the master matches the plan


class Ros1Island:
    """Its master, and the nodes on both sides. To be made in the loop, in which all but ``publisher``,
    ``remove`` and ``state`` is called."""

    def __init__(self, config: Config, peer: Ros1Peer, home: Home) -> None:
        self._config, self._loop = config, asyncio.get_running_loop()
        crossings = {one.topic: one for one in (*peer.receives, *peer.sends)}
        found = {one.type: md5sum_and_least(one.type) for one in crossings.values()}
        self._sums = {kind: one[0] for kind, one in found.items() if one is not None}
        self._lacking = {
            topic: f"this host lacks {one.type}"
            for topic, one in crossings.items()
            if one.type not in self._sums
        }
        receives = {one.topic: one for one in peer.receives if one.type in self._sums}
        self.sends = {one.topic: one for one in peer.sends if one.type in self._sums}
        self._peer = multimaster.Peer(
            peer.island, peer.master, peer.hosts, _kinds(receives.values()), _kinds(self.sends.values())
        )
        self._master = Master(peer.master, config.node, {*receives, *self.sends})
        self._wake, self._api, self._uri = asyncio.Event(), slave.SlaveApi(), ""
        self._arrivals = Arrivals(config, self._peer, receives, self._sums, home)
        self._nodes = Nodes(config, peer.master)
        self._problem = "no answer yet"
        self._refused: tuple[str, ...] = ()
        self._registered: frozenset[Entry] = frozenset()

    def publisher(self, sender: str, message: Any, crossing: Crossing, quality: Quality) -> Outgoing:
        """Returns a new publisher at the master, of a node with this name."""
        made = Outgoing(
            self._loop, sender, crossing, self._sums[crossing.type], message, latched=quality.latched
        )
        self._loop.call_soon_threadsafe(self._change, self._nodes.wanted.add, made)
        return made

    def remove(self, _sender: str, publisher: Outgoing) -> None:
        """Removes a publisher, and its node if it has no other one."""
        self._loop.call_soon_threadsafe(self._change, self._nodes.wanted.discard, publisher)

    def _change(self, change: Callable[[Outgoing], None], publisher: Outgoing) -> None:
        change(publisher)
        self._wake.set()

    def state(self) -> PeerState:
        """The state of the peer now."""
        sent = {
            f"gets {topic}": sorted(one.node for one in self._registered if one.topic == topic)
            for topic in self.sends
        }
        unfit, troubled = self._arrivals.problems()
        return PeerState(
            self._peer.island,
            self._problem,
            {**self._lacking, **unfit},
            (*self._refused, *troubled, *self._nodes.problems()),
            {**self._arrivals.senders(), **sent},
        )

    async def run(self) -> None:
        """Runs until cancelled."""
        self._uri = f"http://{self._config.address}:{await self._api.start()}/"
        self._api.methods = slave.methods(
            self._peer.master, {}, offer=lambda _topic: [], wake=lambda _topic: self._wake.set()
        )
        while True:
            try:
                await self._settle()
                self._problem = ""
            except (PeerError, OSError) as error:  # the latter: no file descriptor is left
                self._problem = str(error)
            await asyncio.sleep(_SHORTEST_WAIT)
            with contextlib.suppress(asyncio.TimeoutError):
                await within(_PERIOD, self._wake.wait())
            self._wake.clear()

    async def leave(self) -> None:
        """Removes all registrations of the relay at the master. Raises ``PeerError``."""
        graph = await self._master.look(self._names_wanted)
        drop = registrations.plan_for(set(), graph, self._config.address, self.sends).drop
        me = self._config.node
        await self._master.do([
            *(_unregistering(one) for one in drop),
            *(("unregisterSubscriber", me, topic, self._uri) for topic in self._peer.receives),
        ])  # fmt: skip

    async def _settle(self) -> None:
        """Looks at the master and makes the missing calls, until none is missing."""
        me = self._config.node
        for _ in range(_ROUNDS):
            await self._nodes.follow()
            graph = await self._master.look(self._names_wanted)
            arriving = self._arrivals.follow(graph)
            wanted = self._nodes.entries()
            self._registered = wanted & graph.entries
            plan = registrations.plan_for(wanted, graph, self._config.address, self.sends)
            missing, extra = reconcile.subscriptions(self._peer, graph, me, self._uri)
            calls = [_unregistering(one) for one in plan.drop]
            calls += [("unregisterSubscriber", me, topic, uri) for topic, uri in extra]
            kinds = self._peer.receives
            calls += [("registerSubscriber", me, topic, kinds[topic], self._uri) for topic in missing]
            kinds = self._peer.sends
            calls += [
                ("registerPublisher", one.node, one.topic, kinds[one.topic], one.uri) for one in plan.add
            ]
            self._refused = (*arriving, *plan.refused)
            if not calls:
                return
            if any(code != 1 for code, _ in await self._master.do(calls)):
                raise PeerError("the master refused a registration")

    def _names_wanted(self, graph: Graph) -> frozenset[str]:
        sent = registrations.publishers(graph, self.sends) | self._nodes.names
        return reconcile.names_wanted(self._peer, graph) | sent


def _unregistering(entry: Entry) -> Call:
    return "unregisterPublisher", entry.node, entry.topic, entry.uri


def _kinds(crossings: Collection[Crossing]) -> dict[str, str]:
    return {one.topic: one.type for one in crossings}
