"""What nodes of this host publish, as the master of its island has them."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from swarm_onboard.agent.errors import FailedError
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.record import Request

_AT_ONCE = 20  # calls of the master


def published(request: Request) -> dict[str, set[str]]:
    """Returns the hosts of the nodes that publish each topic; an empty text for a node whose host is unknown.

    Raises ``FailedError`` if the master does not answer.
    """
    try:
        publishers, homes = asyncio.run(_publishers(request))
    except PeerError as error:
        raise FailedError(
            f"{request.master} does not answer: {error}", "`swarmctl status SPEC` shows why"
        ) from error
    return {topic: {homes.get(node, "") for node in nodes} for topic, nodes in publishers.items()}


async def _publishers(request: Request) -> tuple[dict[str, set[str]], dict[str, str]]:
    """The nodes by topic, and the host of each node that has one of the island."""
    state, _ = await client.system_state(request.master)
    nodes = sorted({node for of_topic in state.values() for node in of_topic})
    turns = asyncio.Semaphore(_AT_ONCE)
    homes: dict[str, str] = {}

    async def look(node: str) -> None:
        async with turns:
            try:
                place = place_of(str(await client.call(request.master, "lookupNode", node)))[0]
            except client.FailedCallError:  # it has left meanwhile
                return
        if place in request.homes:
            homes[node] = request.homes[place]

    await asyncio.gather(*map(look, nodes))
    return {topic: set(of_topic) for topic, of_topic in state.items()}, homes
