"""The master of an island and the nodes of a host, observed without joining the ROS 1 graph.

A node that fails does not affect the others; a part that fails is in ``troubles``, with the reason.
"""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, AbstractSet, Any, Mapping, Sequence

from swarm_onboard.agent.clip import clipped
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client, islands, launched, name_conflicts, nodes, peers, simulated_time

if TYPE_CHECKING:
    from swarm_onboard.agent.probe_messages import (
        GraphAnswer,
        GraphRequest,
        MasterAnswer,
        ProbeAnswer,
        ProbeRequest,
        SenderAnswer,
    )

_CALLS = 4 * client.CALL_SECONDS  # the calls that come one after the other before and after the listening
_MOST_NODES = 200
_MOST_NAMES = 20  # publishers of one topic
_MOST_OTHERS = 400  # topics that are looked up for their type
_MOST_SENDERS = 400  # nodes that publish on the topics that command robots


def observe(request: ProbeRequest, answer: ProbeAnswer) -> None:
    """Fill in the ``GraphAnswer`` of master and nodes; keeps what has arrived when the time is up."""
    running = launched.running(request, answer)
    asyncio.run(_in_time(request, answer, running))
    launched.add_endings(answer, running)


def observe_logs(answer: ProbeAnswer) -> None:
    """Fill in the conflicts of names; ``answer`` has the last states of the units."""
    name_conflicts.add(answer)


async def _in_time(request: ProbeRequest, answer: GraphAnswer, running: launched.Running) -> None:
    topics = [*(node["topics"] for node in request["nodes"]), *request["launched"].values()]
    listening = [*(one for wanted in topics for one in wanted.values()), request["clock"] or 0.0]
    longest = max(map(nodes.seconds_of, listening))
    rounds = 2 if request["launched"] else 1  # topics that no node of roslaunch has are looked for afterwards
    answer["nodes"], answer["commanders"], answer["senders"] = {}, {}, {}
    answer["launched"], answer["receivers"], answer["others"], answer["peers"] = {}, {}, {}, {}
    try:
        await asyncio.wait_for(_master_and_nodes(request, answer, running), rounds * longest + 2 * _CALLS)
    except asyncio.TimeoutError:
        answer["troubles"]["ros"] = "master and nodes took too long to answer"


async def _master_and_nodes(request: ProbeRequest, answer: GraphAnswer, running: launched.Running) -> None:
    uri = str(request["master"])
    answer["master"] = await master(uri)
    if not answer["master"]["reachable"]:
        return
    providers = await _providers(uri, request["provides"], answer)
    works = [nodes.look(uri, one, answer["nodes"], providers) for one in request["nodes"][:_MOST_NODES]]
    if request["commands"]:
        works.append(
            _commanders(uri, request["commands"], request["command_types"], request["publishers"], answer)
        )
    works.append(peers.look(request, answer))
    bridged = request.get("graph")
    if bridged:
        works.append(_graph(uri, bridged, answer))
    if request["clock"] is not None:
        works.append(simulated_time.look(uri, request["clock"], answer))
    works.append(launched.look(request, answer, running, providers))
    await asyncio.gather(*works)


async def _providers(uri: str, services: Sequence[str], answer: GraphAnswer) -> nodes.Providers:
    """The nodes that provide each of ``services``, as the master has them."""
    try:
        found = await client.providers(uri) if services else {}
    except PeerError as error:
        answer["troubles"]["ros"] = str(error)
        return {}
    return {one: found.get(one, []) for one in services}


async def master(uri: str) -> MasterAnswer:
    """Whether a ROS master answers, how fast, and which run of it: two hosts must see the same."""
    began = time.monotonic()
    try:
        pid = await client.call(uri, "getPid")
        latency = time.monotonic() - began
        run_id = await _run_id(uri)
    except PeerError as error:
        return {"reachable": False, "error": str(error)}
    return {
        "reachable": True,
        "pid": nodes.process_of(pid),
        "run_id": clipped(run_id),
        "latency": latency,
    }


async def _run_id(uri: str) -> Any:
    """The run of a master, empty if that parameter is gone. Raises ``PeerError`` if it does not answer."""
    try:
        return await client.call(uri, "getParam", "/run_id")
    except client.FailedCallError:
        return ""


async def _commanders(
    uri: str,
    named: Sequence[str],
    types: Sequence[str],
    wanted: Mapping[str, Sequence[str]],
    answer: GraphAnswer,
) -> None:
    """Who publishes on each topic that is ``named`` or has one of ``types``, and who subscribes to it; who
    publishes on other topics beside the nodes ``wanted``.
    """
    topics = list(named)
    try:
        if types:
            known = await client.call(uri, "getTopicTypes", seconds=3 * client.CALL_SECONDS)
            found = sorted(str(topic) for topic, kind in known if kind in types)
            topics += [topic for topic in found if topic not in named][:_MOST_OTHERS]
        publishers, subscribers = map(_first_names, await client.system_state(uri))
    except PeerError as error:
        answer["troubles"]["commanders"] = str(error)
    except (TypeError, ValueError, LookupError):
        answer["troubles"]["commanders"] = "the master's list of types makes no sense"
    else:
        answer["commanders"] = {topic: publishers.get(topic, []) for topic in topics}
        answer["receivers"] = {topic: subscribers.get(topic, []) for topic in topics}
        unwanted = ((topic, set(publishers.get(topic, ())) - set(nodes)) for topic, nodes in wanted.items())
        answer["others"] = {topic: sorted(names) for topic, names in unwanted if names}
        shown = (*answer["commanders"].values(), *answer["others"].values())
        senders = {name for names in shown for name in names}
        known = {*topics, *answer["others"]}
        works = (_sender(uri, name, known, answer["senders"]) for name in sorted(senders)[:_MOST_SENDERS])
        await asyncio.gather(*works)


def _first_names(side: Mapping[str, list[str]]) -> dict[str, list[str]]:
    return {topic: names[:_MOST_NAMES] for topic, names in side.items()}


async def _sender(
    master_uri: str, name: str, topics: AbstractSet[str], answers: dict[str, SenderAnswer]
) -> None:
    """Where a node runs, and which of ``topics`` it publishes as what: none if it is gone."""
    found: SenderAnswer = {"host": "", "publishes": {}}
    try:
        uri = str(await client.call(master_uri, "lookupNode", name))
        found["host"] = clipped(place_of(uri)[0].lower())
        publishes = nodes.types_of(await client.call(uri, "getPublications"))
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
