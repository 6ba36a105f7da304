"""Who publishes and subscribes what in a graph, and what follows from that. Knows no rclpy."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, AbstractSet, Any, Callable, Iterator, Mapping, Sequence

from swarm_onboard.agent.observations import (
    GraphSeen,
    LaunchedSeen,
    NodeSeen,
    PeerSeen,
    SenderSeen,
    UnmatchedSeen,
)
from swarm_onboard.agent.texts import clipped

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Request

HIDDEN = "_"  # how the name of a node begins that tools do not list
NAMELESS = "_NODE_NAME_UNKNOWN_"  # of an endpoint whose node has not announced itself yet
_NAMES = {NAMELESS: "a node without a name", "_CREATED_BY_BARE_DDS_APP_": "a program without ROS"}
_FAST_DDS = b"\x01\x0f"  # the vendor, with which its GIDs begin
_HOST, _PARTICIPANT = slice(2, 4), slice(0, 12)  # of such a GID
_NO_HASH = "INVALID"
_QUIET = ("/rosout", "/parameter_events")  # of every node
_MOST_PAIRS = 50
_MOST_NAMES = 20  # of one topic
_MOST_TOPICS = 200  # of one node


@dataclass(frozen=True)
class Endpoint:
    """A publisher or a subscription. ``quality``: as ``Graph.incompatible`` takes it."""

    node: str
    topic: str
    type: str
    hash: str
    gid: bytes
    quality: Any = None


@dataclass(frozen=True)
class Graph:
    """``nodes``: full names, each as often as the graph has it. ``own_gid``: of an endpoint of this process.

    ``services``: type by name, by node, of services and actions.
    ``incompatible`` returns which policies of a publisher and a subscription do not match, in words.
    """

    nodes: Sequence[str]
    publishers: Sequence[Endpoint]
    subscriptions: Sequence[Endpoint]
    own_gid: bytes = b""
    incompatible: Callable[[Any, Any], str] = field(default=lambda publisher, subscription: "")
    services: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def publishing(self, topic: str) -> list[Endpoint]:
        """The publishers of a topic."""
        return [one for one in self.publishers if one.topic == topic]


def full_name(namespace: str, name: str) -> str:
    """The full name of a node, or what is known of one that has none."""
    return _NAMES.get(name) or clipped(f"{namespace.rstrip('/')}/{name}")


def is_hidden(node: str) -> bool:
    """Whether tools do not list the node: those of the tools themselves."""
    return node.rpartition("/")[2].startswith(HIDDEN)


def settled(graph: Graph, request: Request) -> bool:
    """Whether every node that is looked for has been seen, with the topics that are measured."""
    seen, nodes = set(graph.nodes), request.nodes.keys() - request.skippable.keys()
    if not seen >= {*nodes, *request.peers}:
        return False
    has = {(one.node, one.topic) for one in graph.publishers}
    wanted = {(node, topic) for node in nodes for topic in request.nodes[node]}
    return wanted <= has and _NAMES[NAMELESS] not in {node for node, _ in has}


def parts(graph: Graph, request: Request) -> dict[str, Any]:
    """Returns the fields of an answer that need no listening."""
    seen = set(graph.nodes)
    hosts = _hosts(graph, request)
    found = {
        "seen": sum(not is_hidden(one) for one in graph.nodes),
        "nodes": {name: _node(graph, name, request) for name in request.nodes},
        "peers": {node: PeerSeen("") for node in request.peers if node in seen},
        "launched": {
            unit: _launched(graph, unit, topics, request) for unit, topics in request.launched.items()
        },
        **_commanders(graph, request, hosts),
    }
    if request.homes:
        found["doubles"] = {
            node: _places(graph, node, hosts)
            for node, count in Counter(graph.nodes).items()
            if count > 1 and not is_hidden(node)
        }
        found["unmatched"] = list(_unmatched(graph))[:_MOST_PAIRS]
    if request.graph:
        bridged = request.bridged
        if bridged is None:
            bridged = sorted({one.topic for one in graph.publishers})
        publishers = {
            topic: {one.node: hosts.get(_host(one), "") for one in graph.publishing(topic)}
            for topic in bridged
        }
        types = {one.topic: clipped(one.type) for one in graph.publishers if one.topic in bridged}
        found["graph"] = GraphSeen(publishers, types, [])
    return found


def _node(graph: Graph, name: str, request: Request) -> NodeSeen:
    if name not in graph.nodes:
        return NodeSeen(False, False)
    return NodeSeen(
        True,
        True,
        publishes=_types(graph.publishers, name),
        subscribes=_types(graph.subscriptions, name),
        provides={
            service: clipped(kind)
            for service, kind in graph.services.get(name, {}).items()
            if service in request.provides
        },
    )


def _types(endpoints: Sequence[Endpoint], node: str) -> dict[str, str]:
    found = {clipped(one.topic): clipped(one.type) for one in endpoints if one.node == node}
    return dict(list(found.items())[:_MOST_TOPICS])


def _launched(graph: Graph, unit: str, topics: Mapping[str, float], request: Request) -> LaunchedSeen:
    """The nodes of a unit that names none: those of this host with its topics or services that the spec does
    not name. One of them takes the commands of a driver; other nodes publish these.
    """
    taken = request.expected[unit]["subscribes"] if unit in request.expected else ()
    having = [
        *(one for one in (*graph.publishers, *graph.subscriptions) if one.topic in topics),
        *(one for one in graph.subscriptions if one.topic in taken),
        *(one for one in graph.publishers if topics.keys() & graph.services.get(one.node, ())),
    ]
    names = dict.fromkeys(
        one.node for one in having if one.node not in request.nodes and _is_of_this_host(one, graph)
    )
    nodes = {name: _node(graph, name, request) for name in names if name in graph.nodes}
    return LaunchedSeen(nodes)


def _host(one: Endpoint) -> bytes:
    """What the GID contains of the host; empty if it contains none."""
    return one.gid[_HOST] if one.gid.startswith(_FAST_DDS) else b""


def _is_of_this_host(one: Endpoint, graph: Graph) -> bool:
    own = graph.own_gid[_HOST] if graph.own_gid.startswith(_FAST_DDS) else b""
    return not own or not _host(one) or _host(one) == own


def _hosts(graph: Graph, request: Request) -> dict[bytes, str]:
    """The hosts by what GIDs contain of them: those whose nodes are known, and this one."""
    found: dict[bytes, str] = {}
    counts = Counter(graph.nodes)
    for one in graph.publishers:
        if _host(one) and counts[one.node] == 1 and one.node in request.homes:
            found.setdefault(_host(one), request.homes[one.node].lower())
    if graph.own_gid.startswith(_FAST_DDS):
        found[graph.own_gid[_HOST]] = request.advertised.lower()
    for node, home in request.homes.items():  # of several of one name, one is at home
        others = {_host(one) for one in graph.publishers if one.node == node} - {b"", *found}
        if len(others) == 1 and home.lower() not in found.values():
            found[others.pop()] = home.lower()
    return found


def _places(graph: Graph, node: str, hosts: Mapping[bytes, str]) -> list[str]:
    """The hosts of the nodes of one name, one for each process of which an endpoint is known."""
    own = (one for one in (*graph.publishers, *graph.subscriptions) if one.node == node)
    processes = {one.gid[_PARTICIPANT]: hosts.get(_host(one), "") for one in own}
    return sorted(processes.values())[:_MOST_NAMES]


def _commanders(graph: Graph, request: Request, hosts: Mapping[bytes, str]) -> dict[str, Any]:
    """Who publishes on each topic of commands, and who subscribes to it; who publishes what others should."""
    kinds = set(request.command_types)
    topics = dict.fromkeys(request.commands)
    topics.update(
        dict.fromkeys(one.topic for one in (*graph.publishers, *graph.subscriptions) if one.type in kinds)
    )
    unwanted = (
        (topic, [one for one in _names(graph.publishers, topic) if one not in wanted])
        for topic, wanted in request.publishers.items()
    )
    others = {topic: names for topic, names in unwanted if names}
    known: AbstractSet[str] = {*topics, *others}
    senders: dict[str, dict[str, str]] = {}
    homes: dict[str, str] = {}
    for one in graph.publishers:
        if one.topic in known:
            homes.setdefault(one.node, hosts.get(_host(one), ""))
            senders.setdefault(one.node, {})[one.topic] = clipped(one.type)
    return {
        "commanders": {topic: _names(graph.publishers, topic) for topic in topics},
        "receivers": {topic: _names(graph.subscriptions, topic) for topic in topics},
        "others": others,
        "senders": {node: SenderSeen(homes[node], publishes) for node, publishes in senders.items()},
    }


def _names(endpoints: Sequence[Endpoint], topic: str) -> list[str]:
    """The nodes with an endpoint of ``topic``; not those that have not announced their names."""
    names = {one.node for one in endpoints if one.topic == topic} - {_NAMES[NAMELESS]}
    return sorted(names)[:_MOST_NAMES]


def _unmatched(graph: Graph) -> Iterator[UnmatchedSeen]:
    """Publishers and subscriptions of one topic that exchange nothing."""
    by_topic: dict[str, list[Endpoint]] = {}
    for one in graph.subscriptions:
        by_topic.setdefault(one.topic, []).append(one)
    for publisher in graph.publishers:
        for one in by_topic.get(publisher.topic, ()) if publisher.topic not in _QUIET else ():
            alike = publisher.type == one.type and not _differ(publisher.hash, one.hash)
            policies = graph.incompatible(publisher.quality, one.quality) if alike else ""
            if not alike or policies:
                yield UnmatchedSeen(
                    clipped(one.topic),
                    publisher.node,
                    one.node,
                    clipped(one.type),
                    clipped(publisher.type),
                    clipped(policies),
                )


def _differ(one: str, other: str) -> bool:
    """Whether two hashes of a type's definition are known and differ."""
    return one != other and not {"", _NO_HASH} & {one, other}
