"""The master of an island and the nodes of a host, observed without joining the ROS 1 graph.

A node that fails does not affect the others; a part that fails is in ``troubles``, with the reason.
"""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, AbstractSet, Any, AsyncIterator, Mapping

from swarm_onboard.agent.observations import MasterSeen, SenderSeen
from swarm_onboard.agent.texts import clipped
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client, connections, islands, launched, nodes, simulated_time

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Answer, Request

    Parts = AsyncIterator[Mapping[str, Any]]  # fields of an answer; a mapping adds to the one that is there

_CALLS = 4 * client.CALL_SECONDS  # the calls that come one after the other before and after the listening
_MOST_NODES = 200
_MOST_NAMES = 20  # publishers of one topic
_MOST_OTHERS = 400  # topics that are looked up for their type
_MOST_SENDERS = 400  # nodes that publish on the topics that command robots


def observe(request: Request, answer: Answer) -> Answer:
    """Returns the answer with master and nodes; keeps what has arrived when the time is up."""
    look = _Look(request, answer)
    asyncio.run(look.in_time())
    return launched.with_endings(look.answer, look.running)


def observe_logs(answer: Answer) -> Answer:
    """Returns the answer, which has the last states of the units, with the conflicts of names."""
    return nodes.added(answer)


class _Look:
    """A look at the graph. ``answer`` has what has arrived so far."""

    def __init__(self, request: Request, answer: Answer) -> None:
        self._request = request
        self._troubles: dict[str, str] = {**answer.troubles}
        self.answer = answer._replace(troubles=self._troubles)
        self.running = launched.running(request, self._troubles)

    async def in_time(self) -> None:
        request = self._request
        topics = [*request.nodes.values(), *request.launched.values()]
        listening = [*(one for wanted in topics for one in wanted.values()), request.clock or 0.0]
        longest = max(map(nodes.seconds_of, listening))
        # Topics that no node of roslaunch has are looked for afterwards.
        rounds = 2 if request.launched else 1
        try:
            await asyncio.wait_for(self._master_and_nodes(), nodes.LATE + rounds * longest + 2 * _CALLS)
        except asyncio.TimeoutError:
            self._troubles["ros"] = "master and nodes took too long to answer"

    async def _master_and_nodes(self) -> None:
        request, uri = self._request, str(self._request.master)
        seen = await master(uri)
        self.answer = self.answer._replace(master=seen)
        if not seen.reachable:
            return
        providers = await self._providers()
        parts = [
            self._add("ros", _node(uri, name, request, providers))
            for name in list(request.nodes)[:_MOST_NODES]
        ]
        if request.commands:
            parts.append(self._add("commanders", _commanders(request)))
        parts.append(self._add("peers", connections.look(request)))
        if request.graph:
            parts.append(self._add("graph", islands.look(request)))
        if request.clock is not None:
            parts.append(self._add("simulated time", simulated_time.look(uri, request.clock)))
        parts += [
            self._add("launched", launched.look(request, unit, pid, providers))
            for unit, pid in self.running.items()
        ]
        await asyncio.gather(*parts)

    async def _add(self, name: str, parts: Parts) -> None:
        """Adds parts to the answer as they arrive."""
        try:
            async for part in parts:
                known = self.answer._asdict()
                merged: dict[str, Any] = {
                    field: {**known[field], **value} if isinstance(value, dict) else value
                    for field, value in part.items()
                }
                self.answer = self.answer._replace(**merged)
        except (PeerError, OSError) as error:
            self._troubles[name] = clipped(error)
        except Exception as error:  # noqa: BLE001  (whatever a node sends, it must not take the other parts away)
            self._troubles[name] = clipped(f"{type(error).__name__}: {error}")

    async def _providers(self) -> nodes.Providers:
        """The nodes that provide each service of the request, as the master has them."""
        services = self._request.provides
        try:
            found = await client.providers(self._request.master) if services else {}
        except PeerError as error:
            self._troubles["ros"] = str(error)
            return {}
        return {one: found.get(one, []) for one in services}


async def _node(uri: str, name: str, request: Request, providers: nodes.Providers) -> Parts:
    async for node in nodes.look(uri, name, request.nodes[name], providers, request.parameters.get(name)):
        yield {"nodes": {name: node}}


async def master(uri: str) -> MasterSeen:
    """Whether a ROS master answers, how fast, and which run of it: two hosts must see the same."""
    began = time.monotonic()
    try:
        await client.call(uri, "getPid")
        latency = time.monotonic() - began
        run_id = await _run_id(uri)
    except PeerError as error:
        return MasterSeen(False, str(error))
    return MasterSeen(True, run_id=clipped(run_id), latency=latency)


async def _run_id(uri: str) -> Any:
    """The run of a master, empty if that parameter is gone. Raises ``PeerError`` if it does not answer."""
    try:
        return await client.call(uri, "getParam", "/run_id")
    except client.FailedCallError:
        return ""


async def _commanders(request: Request) -> Parts:
    """Who publishes on each topic of commands, named or of a type of these, and who subscribes to it; who
    publishes on other topics beside the nodes that should; each of these publishers.
    """
    uri, named, types, topics = request.master, request.commands, request.command_types, [*request.commands]
    try:
        if types:
            known = await client.call(uri, "getTopicTypes", seconds=3 * client.CALL_SECONDS)
            found = sorted(str(topic) for topic, kind in known if kind in types)
            topics += [topic for topic in found if topic not in named][:_MOST_OTHERS]
        publishers, subscribers = map(_first_names, await client.system_state(uri))
    except (TypeError, ValueError, LookupError):
        raise PeerError("the master's list of types makes no sense") from None
    unwanted = (
        (topic, set(publishers.get(topic, ())) - set(wanted)) for topic, wanted in request.publishers.items()
    )
    commanders = {topic: publishers.get(topic, []) for topic in topics}
    others = {topic: sorted(names) for topic, names in unwanted if names}
    yield {
        "commanders": commanders,
        "receivers": {topic: subscribers.get(topic, []) for topic in topics},
        "others": others,
    }
    senders = {name for names in (*commanders.values(), *others.values()) for name in names}
    known = {*topics, *others}
    first = sorted(senders)[:_MOST_SENDERS]
    seen = await asyncio.gather(*(_sender(uri, name, known) for name in first))
    yield {"senders": dict(zip(first, seen))}


def _first_names(side: Mapping[str, list[str]]) -> dict[str, list[str]]:
    return {topic: names[:_MOST_NAMES] for topic, names in side.items()}


async def _sender(master_uri: str, name: str, topics: AbstractSet[str]) -> SenderSeen:
    """Where a node runs, and which of ``topics`` it publishes as what: none if it is gone."""
    found = SenderSeen()
    try:
        uri = str(await client.call(master_uri, "lookupNode", name))
        found = SenderSeen(clipped(place_of(uri)[0].lower()))
        publishes = nodes.types_of(await client.call(uri, "getPublications"))
    except PeerError as error:
        return found._replace(error=str(error))
    return found._replace(publishes={topic: kind for topic, kind in publishes.items() if topic in topics})
