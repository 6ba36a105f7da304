"""Whether nodes of an island take simulated time, and whether its clock moves (wiki.ros.org/Clock)."""

from __future__ import annotations

from typing import Any, AsyncIterator, Mapping

from swarm_onboard.agent.observations import SimulatedTimeSeen
from swarm_onboard.common.xmlrpc import PeerError
from swarm_onboard.ros1_probe import client
from swarm_onboard.ros1_probe.nodes import seconds_of

PARAMETER, CLOCK = "/use_sim_time", "/clock"
_TIME = 8  # bytes of a rosgraph_msgs/Clock: s and ns, 32 bits each, little-endian
_MOST_NAMES = 20  # publishers


async def look(uri: str, listening: float) -> AsyncIterator[Mapping[str, Any]]:
    """Yields the parameter of the master at ``uri``; listens to the clock for ``listening`` s, unless 0."""
    is_set = bool(await client.call(uri, "hasParam", PARAMETER))
    found = SimulatedTimeSeen(is_set and bool(await client.call(uri, "getParam", PARAMETER)))
    yield {"simulated_time": found}
    if listening:
        yield {"simulated_time": await _clock(uri, seconds_of(listening), found)}


async def _clock(uri: str, seconds: float, found: SimulatedTimeSeen) -> SimulatedTimeSeen:
    found = found._replace(publishers=await _publishers(uri), seconds=seconds)
    if not found.publishers:
        return found
    flow = client.Flow(seconds)
    try:
        node = str(await client.call(uri, "lookupNode", found.publishers[0]))
        await client.listen(node, CLOCK, flow, caller=f"{client.CALLER}_time")
    except PeerError as error:
        found = found._replace(error=str(error))
    found = found._replace(count=flow.count, seconds=flow.seconds)
    if flow.count > 1 and len(flow.first_small) == len(flow.last_small) == _TIME:
        found = found._replace(moved=stamp_of(flow.last_small) - stamp_of(flow.first_small))
    if flow.count and len(flow.last_small) == _TIME:
        found = found._replace(now=stamp_of(flow.last_small))
    return found


async def _publishers(uri: str) -> list[str]:
    publishers, _ = await client.system_state(uri)
    return publishers.get(CLOCK, [])[:_MOST_NAMES]


def stamp_of(body: bytes) -> float:
    """The time in a serialised rosgraph_msgs/Clock, s."""
    return int.from_bytes(body[:4], "little") + int.from_bytes(body[4:8], "little") / 1e9
