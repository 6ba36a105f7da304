"""Subscribers of this host that have no connection to a publisher of their topic.

A master calls the slave API of each node (``publisherUpdate``). A subscriber calls that of each publisher
(``requestTopic``), and connects to its port for topics (wiki.ros.org/ROS/Technical Overview).

Both may run, and the ports between them be open: the publisher has another definition of the type and drops
the connection (wiki.ros.org/ROS/TCPROS), or the announcement of the publisher was lost, which a master
sends only once. Each node knows its own connections (``getBusInfo``, wiki.ros.org/ROS/Slave_API).
"""

from __future__ import annotations

import asyncio
import re
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, AsyncIterator, Mapping, TypeVar

from swarm_onboard.agent import files, processes
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.observations import PeerSeen, UnconnectedSeen
from swarm_onboard.agent.texts import clipped
from swarm_onboard.common.xmlrpc import PeerError, place_of
from swarm_onboard.ros1_probe import client, nodes

if TYPE_CHECKING:
    from typing import AbstractSet, Awaitable, Callable, Iterable, Sequence

    from swarm_onboard.agent.verbs.probe import Request


if TYPE_CHECKING:
    Pair = tuple[str, str, str]  # the subscriber, the topic, the publisher
    Side = Mapping[str, Sequence[str]]

T = TypeVar("T")

_MOST_PAIRS = 200
_TIME_TO_CONNECT = 1.5  # s for a subscriber to which a publisher has just been announced
_PYTHON = "/usr/lib/python3/dist-packages"
_MD5 = re.compile(rb'_md5sum = "([0-9a-f]{32})"')  # in what genpy generates of a .msg file


class _Connections(NamedTuple):
    """The URI of a node, and of each of its connections the far end and the topic.

    The far end of a subscription is the URI of the publisher, that of a publication the subscriber's name.
    """

    uri: str
    far_ends: AbstractSet[tuple[str, str]]


async def without_connection(request: Request, state: tuple[Side, Side]) -> list[UnconnectedSeen]:
    """Returns the pairs that are not connected now, and not a moment later.

    ``state``: the publishers and the subscribers of each topic. Nodes that do not answer have no pairs.
    """
    publishers, subscribers = state
    master, own_host = request.master, str(request.advertised).lower()
    uris = await _each(
        {name for topic in request.inputs for name in subscribers.get(topic, ())}, partial(_uri, master)
    )
    here = [name for name, uri in uris.items() if place_of(uri)[0].lower() == own_host]
    pairs = [
        (subscriber, topic, publisher)
        for topic in request.inputs
        for subscriber in here
        if subscriber in subscribers.get(topic, ())
        for publisher in publishers.get(topic, ())
    ]
    missing = await _unconnected(master, pairs[:_MOST_PAIRS])
    if missing:
        await asyncio.sleep(_TIME_TO_CONNECT)
        missing = await _unconnected(master, missing)
    return list(await asyncio.gather(*(_described(master, *one) for one in missing)))


async def _unconnected(master: str, pairs: Sequence[Pair]) -> list[Pair]:
    """Returns those of ``pairs`` of which one node does not know the connection to the other."""
    names = {name for subscriber, _, publisher in pairs for name in (subscriber, publisher)}
    seen = await _each(names, partial(_connections, master))
    return [
        (subscriber, topic, publisher)
        for subscriber, topic, publisher in pairs
        if subscriber in seen
        and publisher in seen
        and not (
            (seen[publisher].uri, topic) in seen[subscriber].far_ends
            and (subscriber, topic) in seen[publisher].far_ends
        )
    ]


async def _each(names: Iterable[str], call: Callable[[str], Awaitable[T]]) -> dict[str, T]:
    """What ``call`` returns for each node, without those for which it raises ``PeerError``."""
    found: dict[str, T] = {}

    async def add(name: str) -> None:
        with suppress(PeerError):
            found[name] = await call(name)

    await asyncio.gather(*map(add, names))
    return found


async def _uri(master: str, name: str) -> str:
    """The URI of a node. Raises ``PeerError``."""
    uri = str(await client.call(master, "lookupNode", name))
    place_of(uri)
    return uri.rstrip("/")


async def _connections(master: str, name: str) -> _Connections:
    """The connections of a node. Raises ``PeerError`` if it does not answer."""
    uri = await _uri(master, name)
    return _Connections(uri, _far_ends(await client.call(uri, "getBusInfo")))


def _far_ends(bus: Any) -> set[tuple[str, str]]:
    try:
        return {(str(far).rstrip("/"), str(topic)) for _, far, _, _, topic, connected, *_ in bus if connected}
    except (TypeError, ValueError):
        raise PeerError("its list of connections makes no sense") from None


async def _described(master: str, subscriber: str, topic: str, publisher: str) -> UnconnectedSeen:
    """A pair, with the type and its MD5 sum on both sides, as far as they can be found out."""
    found = UnconnectedSeen(subscriber, publisher, "", topic)
    with suppress(PeerError):
        uri = await _uri(master, publisher)
        found = found._replace(uri=clipped(uri))
        kind, md5 = await client.type_of(uri, topic)
        found = found._replace(publisher_type=kind, publisher_md5=md5)
        own = await _uri(master, subscriber)
        kind = nodes.types_of(await client.call(own, "getSubscriptions")).get(topic, "")
        found = found._replace(type=kind)
        found = found._replace(md5=md5_of(kind, nodes.process_of(await client.call(own, "getPid"))))
    return found


def md5_of(kind: str, pid: int, proc: str = "/proc") -> str:
    """The MD5 sum of the type of a message as the process ``pid`` would import it; empty if not found.

    The module is read and not imported: it may be a user's.
    """
    package, _, name = kind.partition("/")
    if not package.isidentifier() or not name.isidentifier():
        return ""
    try:
        variables = (files.read(f"{proc}/{pid}/environ") or b"").decode("utf-8", "replace").split("\0")
        paths = [one.partition("=")[2] for one in variables if one.startswith("PYTHONPATH=")]
        for folder in ":".join([*paths, _PYTHON]).split(":"):
            path = f"{folder}/{package}/msg/_{name}.py"
            content = files.read(path) if folder.startswith("/") else None
            if content is not None:
                found = _MD5.search(content)
                return found[1].decode("ascii") if found else ""
    except OSError:  # the process has ended, or the file is not readable
        pass
    return ""


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
    unconnected = asyncio.ensure_future(without_connection(request, state))
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
