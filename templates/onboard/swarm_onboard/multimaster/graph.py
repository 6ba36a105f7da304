"""The graph of a master, as values: the calls that query it, and how their answers are parsed. Pure.

The static multimaster keeps its record as a parameter at its own master. It lives as long as the
registrations that it lists: a master that restarts loses both. After a crash it shows which registrations
are left; other islands read from it which publishers were brought here from elsewhere, and report none of
them. Anybody can write it, so it decides nothing that the hosts in the URIs do not show.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Collection, Iterable, Mapping, Sequence

from swarm_onboard.common.xmlrpc import NonsenseError
from swarm_onboard.multimaster.config import NAME
from swarm_onboard.multimaster.rpc import Answer, Call

RECORD = "/multimaster/record"

_UNKNOWN = -1  # of the Master API: no such node, no such parameter
_LONGEST_URI = 256


@dataclass(frozen=True, order=True)
class Entry:
    """One publisher of one topic, as registered at a master."""

    topic: str
    node: str
    uri: str


@dataclass(frozen=True)
class Record:
    """The registrations of a node: the entries it brought to its master, each with its island, and the
    masters at which it subscribes to changes."""

    entries: Mapping[Entry, str] = field(default_factory=dict)
    masters: frozenset[str] = frozenset()

    def packed(self) -> list[Any]:
        """As a parameter of the master, in a fixed order."""
        entries = sorted(self.entries.items())
        return [
            [[island, entry.topic, entry.node, entry.uri] for entry, island in entries],
            sorted(self.masters),
        ]


@dataclass(frozen=True)
class Graph:
    """The requested part of a master's graph."""

    publishers: frozenset[tuple[str, str]]  # topic and node
    subscribed: frozenset[str]  # topics that the querying node subscribes to
    types: Mapping[str, str]
    nodes: Mapping[str, str]  # URI by name
    record: Record

    @property
    def entries(self) -> frozenset[Entry]:
        """The registrations of publishers whose nodes are known."""
        nodes = self.nodes
        return frozenset(Entry(topic, node, nodes[node]) for topic, node in self.publishers if node in nodes)


def questions(me: str, names: Sequence[str]) -> list[Call]:
    """The calls that query a master's graph, and the URIs of ``names``."""
    calls: list[Call] = [("getSystemState", me), ("getTopicTypes", me), ("getParam", me, RECORD)]
    return calls + [("lookupNode", me, name) for name in names]


def read(answers: Sequence[Answer], me: str, names: Sequence[str], topics: Collection[str] | None) -> Graph:
    """The graph in ``answers`` to ``questions``, of ``topics`` only if given. Raises NonsenseError."""
    (state_code, state), (types_code, types), (record_code, record), *nodes = answers
    if (state_code, types_code) != (1, 1) or record_code not in (1, _UNKNOWN):
        raise NonsenseError("its reply to getSystemState, getTopicTypes or getParam is an error")
    try:
        publishers, subscribers, _ = state
        return Graph(
            publishers=frozenset(
                (topic, node) for topic, node in _pairs(publishers) if topics is None or topic in topics
            ),
            subscribed=frozenset(topic for topic, node in _pairs(subscribers) if node == me),
            types={topic: _text(kind) for topic, kind in types if topics is None or topic in topics},
            nodes=_known(zip(names, nodes)),
            record=unpacked(record) if record_code == 1 else Record(),
        )
    except (TypeError, ValueError):
        raise NonsenseError("its state is not in the format of a ROS master") from None


def _pairs(state: Any) -> Iterable[tuple[str, str]]:
    for topic, nodes in state:
        for node in nodes:
            if isinstance(topic, str) and isinstance(node, str) and NAME.fullmatch(node):
                yield topic, node


def _known(found: Iterable[tuple[str, Answer]]) -> dict[str, str]:
    nodes = {}
    for name, (code, uri) in found:
        if code == 1:
            nodes[name] = _text(uri)
        elif code != _UNKNOWN:
            raise ValueError(name)
    return nodes


def unpacked(value: Any) -> Record:
    """The record in a master's parameter; an empty one if the value is not a record."""
    try:
        entries, masters = value
        return Record(
            {
                Entry(_text(topic), _text(node), _text(uri)): _text(island)
                for island, topic, node, uri in entries
            },
            frozenset(_text(one) for one in masters),
        )
    except (TypeError, ValueError):
        return Record()


def _text(value: Any) -> str:
    if not isinstance(value, str) or len(value) > _LONGEST_URI or not value.isprintable():
        raise ValueError(value)
    return value
