"""The nodes on other hosts to which nodes of this host connect, and the ports that let none in.

A master calls the slave API of each node (``publisherUpdate``). A subscriber calls that of each publisher
(``requestTopic``), and connects to its port for topics (wiki.ros.org/ROS/Technical Overview).
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING

from swarm_onboard.agent import processes
from swarm_onboard.agent.clip import clipped
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client, connections

if TYPE_CHECKING:
    from swarm_onboard.agent.probe_messages import GraphAnswer, PeerAnswer, ProbeRequest

_MOST_NODES = 200


async def look(request: ProbeRequest, answer: GraphAnswer) -> None:
    """Adds the nodes of the request, and the publishers of its topics, that are on other hosts; and the ports
    on which this host listens, so that a port that nothing has is not taken for a closed one; and the pairs
    of nodes that are not connected.
    """
    wanted: dict[str, list[str]] = {name: [] for name in request["peers"]}
    try:
        answer["listening"] = processes.listening_ports()
        state = await client.system_state(request["master"]) if request["inputs"] else ({}, {})
    except (PeerError, OSError) as error:
        answer["troubles"]["peers"] = clipped(error)
        return
    for topic in request["inputs"]:
        for name in state[0].get(topic, ()):
            wanted.setdefault(name, []).append(topic)
    first = list(wanted.items())[:_MOST_NODES]
    works = [_peer(request, name, topics, answer["peers"]) for name, topics in first]
    await asyncio.gather(*works, connections.look(request, state, answer))


async def _peer(request: ProbeRequest, name: str, topics: list[str], answers: dict[str, PeerAnswer]) -> None:
    """Adds a node of another host. One that is not registered, or hangs, is a matter of other checks."""
    with suppress(PeerError):
        uri = str(await client.call(request["master"], "lookupNode", name))
        host, port = place_of(uri)
        if host == str(request["advertised"]).lower():
            return
        found: PeerAnswer = {"uri": clipped(uri), "topics": topics, "port": 0, "error": ""}
        answers[name] = found
        if await _lets_in(found, host, port) and topics:
            await _lets_in(found, *await client.offered(uri, topics[0]), service=f"{name}/get_loggers")


async def _lets_in(found: PeerAnswer, host: str, port: int, service: str = "") -> bool:
    try:
        await client.try_port(host, port, service)
    except PeerError as error:
        found.update({"port": port, "error": clipped(f"{host}:{port}: {error}")})
        return False
    return True
