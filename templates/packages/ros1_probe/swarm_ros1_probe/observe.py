"""The master of an island and the nodes of a host, observed without joining the ROS 1 graph.

A node that fails does not affect the others; a part that fails is in ``troubles``, with the reason.
"""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Sequence

from swarm_agent.clip import clipped
from swarm_common.xmlrpc import PeerError, place_of

from swarm_ros1_probe import client, islands

if TYPE_CHECKING:
    from swarm_agent.probe_messages import (
        GraphAnswer,
        GraphRequest,
        MasterAnswer,
        NodeAnswer,
        NodeRequest,
        ProbeRequest,
        SenderAnswer,
        TopicAnswer,
    )

LONGEST_LISTENING = 15.0  # s for one topic
_CALLS = 4 * client.CALL_SECONDS  # the calls that come one after the other before and after the listening
_MOST_NODES = 200
_MOST_TOPICS = 20  # of one node
_MOST_NAMES = 20  # publishers of one topic
_MOST_SENDERS = 400  # nodes that publish on the topics that command robots
_DIAGNOSTICS = "/diagnostics"


def observe(request: ProbeRequest, answer: GraphAnswer) -> None:
    """Fill in the answers of master and nodes; keeps what has arrived when the time is up."""
    asyncio.run(_in_time(request, answer))


async def _in_time(request: ProbeRequest, answer: GraphAnswer) -> None:
    longest = max(
        (_seconds(one) for node in request["nodes"] for one in node["topics"].values()), default=0.0
    )
    answer["nodes"], answer["commanders"], answer["senders"] = {}, {}, {}
    try:
        await asyncio.wait_for(_master_and_nodes(request, answer), longest + 2 * _CALLS)
    except asyncio.TimeoutError:
        answer["troubles"]["ros"] = "master and nodes took too long to answer"


def _seconds(value: Any) -> float:
    return min(max(0.0, float(value)), LONGEST_LISTENING)


async def _master_and_nodes(request: ProbeRequest, answer: GraphAnswer) -> None:
    uri = str(request["master"])
    answer["master"] = await master(uri)
    if not answer["master"]["reachable"]:
        return
    works = [_node(uri, one, answer["nodes"]) for one in request["nodes"][:_MOST_NODES]]
    if request["commands"]:
        works.append(_commanders(uri, request["commands"], answer))
    bridged = request.get("graph")
    if bridged:
        works.append(_graph(uri, bridged, answer))
    await asyncio.gather(*works)


async def master(uri: str) -> MasterAnswer:
    """Whether a ROS master answers, how fast, and which run of it: two hosts must see the same."""
    began = time.monotonic()
    try:
        pid = await client.call(uri, "getPid")
        latency = time.monotonic() - began
        run_id = await client.call(uri, "getParam", "/run_id")
    except PeerError as error:
        return {"reachable": False, "error": str(error)}
    return {
        "reachable": True,
        "pid": pid if isinstance(pid, int) else 0,
        "run_id": clipped(run_id),
        "latency": latency,
    }


async def _commanders(uri: str, topics: Sequence[str], answer: GraphAnswer) -> None:
    """Who publishes on each of ``topics``, as the master has it."""
    try:
        publishers = (await client.call(uri, "getSystemState", seconds=3 * client.CALL_SECONDS))[0]
        found = {
            str(topic): [clipped(name) for name in sorted(names)[:_MOST_NAMES]] for topic, names in publishers
        }
    except PeerError as error:
        answer["troubles"]["commanders"] = str(error)
    except (TypeError, ValueError, LookupError):
        answer["troubles"]["commanders"] = "the master's system state makes no sense"
    else:
        answer["commanders"] = {topic: found.get(topic, []) for topic in topics}
        senders = {name for names in answer["commanders"].values() for name in names}
        works = (_sender(uri, name, topics, answer["senders"]) for name in sorted(senders)[:_MOST_SENDERS])
        await asyncio.gather(*works)


async def _sender(
    master_uri: str, name: str, topics: Sequence[str], answers: dict[str, SenderAnswer]
) -> None:
    """Where a node that commands runs, and which of ``topics`` it publishes as what: none if it is gone."""
    found: SenderAnswer = {"host": "", "publishes": {}}
    try:
        uri = str(await client.call(master_uri, "lookupNode", name))
        found["host"] = clipped(place_of(uri)[0])
        publishes = _types(await client.call(uri, "getPublications"))
    except PeerError as error:
        found["error"] = str(error)
    else:
        found["publishes"] = {topic: kind for topic, kind in publishes.items() if topic in topics}
    answers[name] = found


async def _graph(uri: str, request: GraphRequest, answer: GraphAnswer) -> None:
    try:
        answer["graph"] = await islands.look(uri, request)
    except PeerError as error:
        answer["troubles"]["graph"] = str(error)


async def _node(master_uri: str, request: NodeRequest, answers: dict[str, NodeAnswer]) -> None:
    """One node: whether it is registered and alive, its topics, and their rates."""
    name = str(request["name"])
    found: NodeAnswer = {"registered": None, "alive": None, "error": "", "topics": {}}
    answers[name] = found
    try:
        uri = str(await client.call(master_uri, "lookupNode", name))
    except PeerError as error:
        found.update({"registered": False, "error": str(error)})
        return
    found.update({"registered": True, "uri": clipped(uri)})
    try:
        pid, publications, subscriptions = await asyncio.gather(
            client.call(uri, "getPid"),
            client.call(uri, "getPublications"),
            client.call(uri, "getSubscriptions"),
        )
        found.update({"pid": pid if isinstance(pid, int) else 0, "alive": True})
        found.update({"publishes": _types(publications), "subscribes": _types(subscriptions)})
    except PeerError as error:
        found.update({"alive": False, "error": str(error)})
        return
    topics = list(request["topics"].items())[:_MOST_TOPICS]
    await asyncio.gather(*(_topic(uri, topic, _seconds(seconds), found) for topic, seconds in topics))


def _types(pairs: Any) -> dict[str, str]:
    try:
        return {clipped(topic): clipped(kind) for topic, kind in pairs[:200]}
    except (TypeError, ValueError):
        raise PeerError("its list of topics makes no sense") from None


async def _topic(uri: str, topic: str, seconds: float, node: NodeAnswer) -> None:
    flow = client.Flow(seconds)
    entry: TopicAnswer = {"count": 0, "rate": None, "seconds": seconds, "type": "", "error": ""}
    node["topics"][topic] = entry
    try:
        await client.listen(uri, topic, flow, keep_first=topic == _DIAGNOSTICS)
        if flow.first_body:
            node["reports"] = client.diagnostics_in(flow.first_body)
    except PeerError as error:
        entry["error"] = str(error)
    entry.update({"count": flow.count, "rate": flow.rate(time.monotonic()), "type": flow.type})
