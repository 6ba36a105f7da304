"""The other islands' part of a master's graph: publishers of bridged topics, and foreign nodes."""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING, Any, AsyncIterator, Iterable, Mapping

from swarm_onboard.agent.observations import ForeignNode, GraphSeen
from swarm_onboard.agent.texts import clipped
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Request

_MOST_TOPICS = 1000
_MOST_NODES = 1000  # that are looked up
_MOST_FOREIGN = 200
_MOST_NAMES = 50  # topics of one foreign node
_AT_ONCE = 16  # calls to the master


async def look(request: Request) -> AsyncIterator[Mapping[str, Any]]:
    """Yields the graph. Raises ``PeerError`` if the master does not answer or its answer is malformed."""
    master = request.master
    publishes, subscribes = await client.system_state(master)
    kinds = await client.call(master, "getTopicTypes", seconds=3 * client.CALL_SECONDS)
    try:
        types = {str(topic): clipped(kind) for topic, kind in kinds}
    except (TypeError, ValueError, LookupError):
        raise PeerError("the master's list of types makes no sense") from None
    names = {node for side in (publishes, subscribes) for found in side.values() for node in found}
    nodes = await _places(master, names)
    topics = [str(topic) for topic in (request.bridged or ())[:_MOST_TOPICS]]
    publishers = {
        topic: {clipped(node): nodes.get(node, "") for node in publishes.get(topic, [])} for topic in topics
    }
    foreign = _foreign(nodes, publishes, subscribes, {str(one).lower() for one in request.own})
    types = {topic: types[topic] for topic in topics if topic in types}
    yield {"graph": GraphSeen(publishers, types, foreign)}


async def _places(master: str, nodes: Iterable[str]) -> dict[str, str]:
    """The URI of each node that the master knows."""
    gate, found = asyncio.Semaphore(_AT_ONCE), {}

    async def place(node: str) -> None:
        async with gate:
            with contextlib.suppress(PeerError):  # it has just left
                found[node] = clipped(await client.call(master, "lookupNode", node))

    await asyncio.gather(*(place(node) for node in sorted(nodes)[:_MOST_NODES]))
    return found


def _foreign(
    nodes: Mapping[str, str],
    publishes: Mapping[str, list[str]],
    subscribes: Mapping[str, list[str]],
    own: set[str],
) -> list[ForeignNode]:
    def topics(side: Mapping[str, list[str]], node: str) -> list[str]:
        return [clipped(topic) for topic in sorted(side) if node in side[topic]][:_MOST_NAMES]

    foreign = [node for node, uri in sorted(nodes.items()) if _host_of(uri) not in own]
    return [
        ForeignNode(clipped(node), nodes[node], topics(publishes, node), topics(subscribes, node))
        for node in foreign[:_MOST_FOREIGN]
    ]


def _host_of(uri: str) -> str:
    try:
        return place_of(uri)[0].lower()
    except PeerError:
        return ""
