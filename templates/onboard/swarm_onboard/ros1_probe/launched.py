"""The nodes of units whose names the operator does not know: those of launch files and of foreign programs.

roslaunch itself reports its nodes, dead ones too (roslaunch/server.py: ``list_processes``). For topics and
services that none of these has, as in a program without roslaunch, the nodes of this host with them count.
"""

from __future__ import annotations

import asyncio
import re
from pathlib import PurePath
from typing import TYPE_CHECKING, AbstractSet, Any, AsyncIterator, Iterable, Mapping, Sequence

from swarm_onboard.agent import processes, unit_history, unit_journal
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.observations import EndedSeen, LaunchedSeen, NodeSeen
from swarm_onboard.agent.texts import clipped
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client, nodes

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Answer, Request

Running = Mapping[str, int]  # by unit, its process of roslaunch; 0 if it has none

_MOST_NODES = 100  # of one unit
_MOST_PUBLISHERS = 20  # of one topic
_NAME = re.compile(r"(.+)-\d+")  # roslaunch adds a number to the name of a node's process
_STARTED = re.compile(r"process\[([^\[\]]+)-\d+\]: started with pid")
_ENDED = re.compile(r"\[([^\[\]]+)-\d+\] process has (finished cleanly|died)(?:.*?exit code (-?\d+))?")


def running(request: Request, troubles: dict[str, str]) -> Running:
    """Finds roslaunch among the processes of each unit whose nodes are to be found."""
    try:
        found = unit_history.running([str(unit) for unit in request.launched])
    except RefusedError as error:
        troubles["launched"] = clipped(error.message)
        return {}
    return {
        unit: next((one.pid for one in members if _is_roslaunch(one.words)), 0)
        for unit, members in found.items()
    }


def _is_roslaunch(words: Iterable[str]) -> bool:
    return any(PurePath(word).name == "roslaunch" for word in list(words)[:2])


async def look(
    request: Request, unit: str, pid: int, providers: nodes.Providers
) -> AsyncIterator[Mapping[str, Any]]:
    """Yields the nodes of a unit as they get known. ``pid``: as in ``Running``."""
    found = LaunchedSeen()
    topics = request.launched[unit]
    try:
        if pid:
            starts, dead = await _by_roslaunch(pid)
            ended = {one: EndedSeen("") for one in dead if one not in starts}
            found = LaunchedSeen(await _nodes(request, topics, list(starts), providers), starts, ended)
            yield {"launched": {unit: found}}
        lacking = set(topics) - {name for one in found.nodes.values() for name in _names(one)}
        if lacking:
            names = await _by_names(request, lacking, providers)
            others = await _nodes(request, topics, names, providers)
            found = found._replace(nodes={**found.nodes, **others})
    except (PeerError, OSError) as error:
        found = found._replace(error=clipped(error))
    yield {"launched": {unit: found}}


def _names(node: NodeSeen) -> list[str]:
    return [*node.publishes, *node.subscribes, *node.provides]


async def _nodes(
    request: Request, topics: Mapping[str, float], names: Sequence[str], providers: nodes.Providers
) -> dict[str, NodeSeen]:
    listening = {topic: seconds for topic, seconds in topics.items() if seconds > 0}
    seen: dict[str, NodeSeen] = {}

    async def look_at(name: str) -> None:
        async for node in nodes.look(request.master, name, listening, providers, published_only=True):
            seen[name] = node

    await asyncio.gather(*map(look_at, names[:_MOST_NODES]))
    return seen


async def _by_roslaunch(pid: int) -> tuple[dict[str, int], dict[str, int]]:
    """The nodes that roslaunch runs, and those that have ended and stay away, with the number of starts."""
    ports = processes.listening_ports(pid)
    if not ports:
        raise PeerError("roslaunch does not listen yet")
    lists = await client.call_plainly(f"http://127.0.0.1:{ports[0]}/", "list_processes")
    try:
        active, dead = lists
        return _starts(active), _starts(dead)
    except (TypeError, ValueError, LookupError):
        raise PeerError("the answer of roslaunch makes no sense") from None


def _starts(entries: Any) -> dict[str, int]:
    """The starts by node, in what roslaunch returns of its processes, such as ``[["k3/scan-2", 1]]``."""
    matches = ((_NAME.fullmatch(str(name)), int(starts)) for name, starts in entries[:_MOST_NODES])
    return {clipped(f"/{match.group(1)}"): starts for match, starts in matches if match}


async def _by_names(request: Request, wanted: AbstractSet[str], providers: nodes.Providers) -> list[str]:
    """The nodes that advertise this host and have one of the topics and services ``wanted``."""
    sides = (*await client.system_state(request.master), providers)
    wanted = {*wanted, *map(nodes.goals_of, wanted)}
    found = (side.get(name, ())[:_MOST_PUBLISHERS] for side in sides for name in sorted(wanted))
    names = list(dict.fromkeys(name for names in found for name in names))
    places = await asyncio.gather(*(_place(request.master, name) for name in names))
    own = str(request.advertised).lower()
    return [name for name, place in zip(names, places) if place == own]


async def _place(master: str, node: str) -> str:
    """The host in a node's URI; empty if the node is gone."""
    try:
        return place_of(str(await client.call(master, "lookupNode", node)))[0].lower()
    except PeerError:
        return ""


def with_endings(answer: Answer, running: Running) -> Answer:
    """Returns the answer with how the ended nodes ended, from what roslaunch has logged."""
    launched = dict(answer.launched)
    for unit, seen in answer.launched.items():
        if seen.ended:
            try:
                endings = endings_in(unit_journal.messages(unit, 0.0, running[unit]))
            except RefusedError as error:
                return answer._replace(troubles={**answer.troubles, "launched": clipped(error.message)})
            ended = {name: endings.get(name, one) for name, one in seen.ended.items()}
            launched[unit] = seen._replace(ended=ended)
    return answer._replace(launched=launched)


def endings_in(lines: Iterable[unit_journal.Message]) -> dict[str, EndedSeen]:
    """How each node ended for the last time, as roslaunch logged it."""
    starts: dict[str, float] = {}
    found: dict[str, EndedSeen] = {}
    for line in lines:
        started, ended = _STARTED.search(line.text), _ENDED.search(line.text)
        if started:
            starts[f"/{started.group(1)}"] = line.time
        elif ended:
            name = f"/{ended.group(1)}"
            code = "0" if ended.group(2) == "finished cleanly" else ended.group(3)
            lasted = line.time - starts[name] if name in starts else None
            found[name] = EndedSeen(f"exit code {code}" if code else "", lasted)
    return found
