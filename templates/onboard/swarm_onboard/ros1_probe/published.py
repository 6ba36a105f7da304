"""What nodes of this host publish, as the master of its island has them."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from swarm_onboard.agent.errors import FailedError
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client

if TYPE_CHECKING:
    from typing import AbstractSet, Mapping

    from swarm_onboard.agent.recording_messages import Graph

_AT_ONCE = 20  # calls of the master


def published(graph: Graph) -> list[str]:
    """Returns the topics that nodes of this host publish, and no node of another.

    All others are on the hub: those of several hosts, and of nodes whose host is unknown. Raises
    ``FailedError`` if the master does not answer.
    """
    try:
        publishers, homes = asyncio.run(_publishers(graph))
    except PeerError as error:
        raise FailedError(
            f"{graph['master']} does not answer: {error}", "`swarmctl status SPEC` shows why"
        ) from error
    return sorted(
        topic for topic, nodes in publishers.items() if _host_of(nodes, homes, graph) == graph["host"]
    )


def _host_of(nodes: AbstractSet[str], homes: Mapping[str, str], graph: Graph) -> str:
    hosts = {homes.get(node, "") for node in nodes}
    return (hosts.pop() if len(hosts) == 1 else "") or graph["hub"]


async def _publishers(graph: Graph) -> tuple[dict[str, set[str]], dict[str, str]]:
    """The nodes by topic, and the host of each node that has one of the island."""
    state, _ = await client.system_state(graph["master"])
    nodes = sorted({node for of_topic in state.values() for node in of_topic})
    turns = asyncio.Semaphore(_AT_ONCE)
    homes: dict[str, str] = {}

    async def look(node: str) -> None:
        async with turns:
            try:
                place = place_of(str(await client.call(graph["master"], "lookupNode", node)))[0]
            except client.FailedCallError:  # it has left meanwhile
                return
        if place in graph["homes"]:
            homes[node] = graph["homes"][place]

    await asyncio.gather(*map(look, nodes))
    return {topic: set(of_topic) for topic, of_topic in state.items()}, homes
