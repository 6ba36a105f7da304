"""The other islands' part of a master's graph: publishers of bridged topics, and foreign nodes.

Request: ``topics`` that come here or leave here, and ``own``, the addresses and names of this island's hosts.
Answer: ``publishers`` (topic to node to URI), ``types`` (by topic) and ``strangers``: each node whose URI is
none of this island's, with the topics it publishes (``"publishes"``) and subscribes to (``"subscribes"``).
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING, Iterable, Mapping

from swarm_onboard.agent.clip import clipped
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client

if TYPE_CHECKING:
    from swarm_onboard.agent.probe_messages import GraphRequest, IslandsAnswer, StrangerAnswer

_MOST_TOPICS = 1000
_MOST_NODES = 1000  # that are looked up
_MOST_STRANGERS = 200
_MOST_NAMES = 50  # topics of one stranger
_AT_ONCE = 16  # calls to the master


async def look(master: str, request: GraphRequest) -> IslandsAnswer:
    """Returns the answer. Raises ``PeerError`` if the master does not answer or its answer is malformed."""
    publishes, subscribes = await client.system_state(master)
    kinds = await client.call(master, "getTopicTypes", seconds=3 * client.CALL_SECONDS)
    try:
        types = {str(topic): clipped(kind) for topic, kind in kinds}
    except (TypeError, ValueError, LookupError):
        raise PeerError("the master's list of types makes no sense") from None
    names = {node for side in (publishes, subscribes) for found in side.values() for node in found}
    nodes = await _places(master, names)
    topics = [str(topic) for topic in (request["topics"] or ())[:_MOST_TOPICS]]
    return {
        "publishers": {
            topic: {clipped(node): nodes.get(node, "") for node in publishes.get(topic, [])}
            for topic in topics
        },
        "types": {topic: types[topic] for topic in topics if topic in types},
        "strangers": _strangers(nodes, publishes, subscribes, {str(one).lower() for one in request["own"]}),
    }


async def _places(master: str, nodes: Iterable[str]) -> dict[str, str]:
    """The URI of each node that the master knows."""
    gate, found = asyncio.Semaphore(_AT_ONCE), {}

    async def place(node: str) -> None:
        async with gate:
            with contextlib.suppress(PeerError):  # it has just left
                found[node] = clipped(await client.call(master, "lookupNode", node))

    await asyncio.gather(*(place(node) for node in sorted(nodes)[:_MOST_NODES]))
    return found


def _strangers(
    nodes: Mapping[str, str],
    publishes: Mapping[str, list[str]],
    subscribes: Mapping[str, list[str]],
    own: set[str],
) -> list[StrangerAnswer]:
    def topics(side: Mapping[str, list[str]], node: str) -> list[str]:
        return [clipped(topic) for topic in sorted(side) if node in side[topic]][:_MOST_NAMES]

    strangers = [node for node, uri in sorted(nodes.items()) if _host_of(uri) not in own]
    return [
        {
            "node": clipped(node),
            "uri": nodes[node],
            "publishes": topics(publishes, node),
            "subscribes": topics(subscribes, node),
        }
        for node in strangers[:_MOST_STRANGERS]
    ]


def _host_of(uri: str) -> str:
    try:
        return place_of(uri)[0].lower()
    except PeerError:
        return ""
