"""The nodes on other hosts to which nodes of this host connect, and the ports that let none in.

A master calls the slave API of each node (``publisherUpdate``). A subscriber calls that of each publisher
(``requestTopic``), and connects to its port for topics (wiki.ros.org/ROS/Technical Overview).
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, AsyncIterator, Mapping

from swarm_onboard.agent import processes
from swarm_onboard.agent.clip import clipped
from swarm_onboard.agent.observations import PeerSeen
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client, connections

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Request

_MOST_NODES = 200


async def look(request: Request) -> AsyncIterator[Mapping[str, Any]]:
    """Yields the nodes of the request, and the publishers of its topics, that are on other hosts; and the
    ports on which this host listens, so that a port that nothing has is not taken for a closed one; and the
    pairs of nodes that are not connected. Raises ``PeerError``, and ``OSError`` for the ports.
    """
    yield {"listening": processes.listening_ports()}
    wanted: dict[str, list[str]] = {name: [] for name in request.peers}
    state = await client.system_state(request.master) if request.inputs else ({}, {})
    for topic in request.inputs:
        for name in state[0].get(topic, ()):
            wanted.setdefault(name, []).append(topic)
    first = list(wanted.items())[:_MOST_NODES]
    unconnected = asyncio.ensure_future(connections.unconnected(request, state))
    for work in asyncio.as_completed([_peer(request, name, topics) for name, topics in first]):
        name, peer = await work
        if peer is not None:
            yield {"peers": {name: peer}}
    yield {"unconnected": await unconnected}


async def _peer(request: Request, name: str, topics: list[str]) -> tuple[str, PeerSeen | None]:
    """A node of another host. One that is not registered, or hangs, is a matter of other checks."""
    found = None
    try:
        uri = str(await client.call(request.master, "lookupNode", name))
        host, port = place_of(uri)
        if host == str(request.advertised).lower():
            return name, None
        found = PeerSeen(clipped(uri), topics)
        problem = await _problem(host, port)
        if not problem and topics:
            host, port = await client.offered(uri, topics[0])
            problem = await _problem(host, port, f"{name}/get_loggers")
        if problem:
            found = found._replace(port=port, error=clipped(f"{host}:{port}: {problem}"))
    except PeerError:
        pass
    return name, found


async def _problem(host: str, port: int, service: str = "") -> str:
    """Why a port lets nothing in; empty if it does."""
    try:
        await client.try_port(host, port, service)
    except PeerError as error:
        return str(error)
    return ""
