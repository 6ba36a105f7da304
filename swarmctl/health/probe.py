"""The probe's question to a host, and its answer as frozen values.

A host may lie: whatever makes no sense is unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from swarmctl.health.expected import ExpectedGraph, ExpectedHost
from swarmctl.topology.interfaces import DIAGNOSTICS, DriverTopic

AGENT_VERBS = ("probe", "probe_graph", "probe_ros")  # the modules of the agent that the probe is made of
LONGEST_LISTENING = 10.0  # s, however slow a topic is
_A_REPORT = 2.5  # s in which the multimaster node reports at least once
_PERIODS = 2.5  # a rate is measured from at least two messages
_LONGEST_TEXT = 300
_MOST = 20_000  # entries of one mapping

T = TypeVar("T")


@dataclass(frozen=True)
class UnitSeen:
    """A systemd unit. ``restarted`` counts the restarts while the probe looked."""

    load: str
    active: str
    sub: str
    result: str
    text: str
    pid: int
    restarts: int
    restarted: int
    skipped: bool

    @property
    def runs(self) -> bool:
        return self.active in ("active", "reloading")


@dataclass(frozen=True)
class MasterSeen:
    """The master as one host sees it. ``latency`` in s; ``run_id`` tells one run of a master from another."""

    reachable: bool
    error: str
    run_id: str
    latency: float


@dataclass(frozen=True)
class TopicSeen:
    """What came over a topic in ``seconds``. ``rate`` is unknown before the second message."""

    count: int
    rate: float | None
    seconds: float
    type: str
    error: str


@dataclass(frozen=True)
class Report:
    """A driver's own word in /diagnostics; ``level`` as in diagnostic_msgs/DiagnosticStatus.

    ``commander`` is whom it obeys just now: nobody else knows that.
    """

    level: int
    message: str
    commander: str = ""


@dataclass(frozen=True)
class NodeSeen:
    """A node: whether the master knows it, whether it answers, what it publishes and hears (name to type)."""

    registered: bool | None
    alive: bool | None
    uri: str
    pid: int
    error: str
    publishes: Mapping[str, str]
    hears: Mapping[str, str]
    topics: Mapping[str, TopicSeen]
    report: Report | None


@dataclass(frozen=True)
class Stranger:
    """A node that is registered at a master and runs on none of the island's hosts."""

    node: str
    uri: str
    publishes: tuple[str, ...]
    hears: tuple[str, ...]


@dataclass(frozen=True)
class GraphSeen:
    """What a hub's master has of topics that cross: by topic the publishers with their URIs, and the type."""

    publishers: Mapping[str, Mapping[str, str]]
    types: Mapping[str, str]
    strangers: tuple[Stranger, ...]


@dataclass(frozen=True)
class SenderSeen:
    """A node that is registered for orders: the host in its URI, and what it publishes (name to type)."""

    host: str
    publishes: Mapping[str, str]


@dataclass(frozen=True)
class DeviceSeen:
    """A serial device. ``usable``: drivers may open it (mode and group)."""

    exists: bool
    is_device: bool
    usable: bool
    resolves: str
    group: str
    mode: int
    nearby: tuple[str, ...]


@dataclass(frozen=True)
class Answer:
    """What one host says. A part that is missing could not be found out; ``troubles`` may say why."""

    release: str | None = None
    units: Mapping[str, UnitSeen] = field(default_factory=dict)
    master: MasterSeen | None = None
    nodes: Mapping[str, NodeSeen] = field(default_factory=dict)
    commanders: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    senders: Mapping[str, SenderSeen] = field(default_factory=dict)
    graph: GraphSeen | None = None
    devices: Mapping[str, DeviceSeen] = field(default_factory=dict)
    clock_ahead: float | None = None  # s, against the operator's clock
    boot_id: str = ""
    troubles: Mapping[str, str] = field(default_factory=dict)


def request(graph: ExpectedGraph, host: ExpectedHost, window: float) -> dict[str, Any]:
    """What to ask the agent of ``host``. The hub is also asked who commands the robots of its island, and
    what it has of other islands where there are any."""
    island = [one for one in graph.hosts if one.hub == host.name] if host.is_hub else []
    return {
        "verb": "probe",
        "swarm": graph.swarm,
        "units": list(host.release.units),
        "master": host.master_uri,
        "nodes": [
            {"name": robot.node, "topics": {topic.name: listening(topic, window) for topic in robot.topics}}
            for robot in host.robots
        ]
        + [{"name": program.node, "topics": {}} for program in host.programs if program.node]
        + _multimaster_nodes(host, window),
        "graph": _graph_asked(graph, host),
        "commands": [robot.command for one in island for robot in one.robots],
        "devices": [robot.device for robot in host.robots],
    }


def _multimaster_nodes(host: ExpectedHost, window: float) -> list[dict[str, Any]]:
    if host.multimaster is None:
        return []
    speaker = host.multimaster.speaker
    return [
        {"name": node, "topics": {DIAGNOSTICS: round(max(window, _A_REPORT), 3)} if node == speaker else {}}
        for node in host.multimaster.nodes
    ]


def _graph_asked(graph: ExpectedGraph, host: ExpectedHost) -> dict[str, Any] | None:
    """The topics that cross at the master of ``host``, and which addresses are its island's own."""
    if not host.is_hub or len(graph.addresses) < 2:
        return None
    crossing = (one.topic for one in graph.bridges if host.name in (one.hub, one.origin_hub))
    return {"topics": list(dict.fromkeys(crossing)), "own": list(graph.addresses[host.island])}


def listening(topic: DriverTopic, window: float) -> float:
    """How long to listen, s: long enough for two messages of a slow topic."""
    return round(max(window, min(_PERIODS / topic.rate, LONGEST_LISTENING)), 3)


def answer_of(data: Mapping[str, Any], received: float | None = None) -> Answer:
    """The agent's answer, sizes and types checked. ``received``: the operator's clock when it came, s."""
    time = _float_or_none(data.get("time"))
    return Answer(
        release=_text(data.get("release")) or None,
        units=_each(data.get("units"), _unit),
        master=_master(data["master"]) if isinstance(data.get("master"), Mapping) else None,
        nodes=_each(data.get("nodes"), _node),
        commanders={_text(name): _texts(found) for name, found in _items(data.get("commanders"))},
        graph=_graph(data["graph"]) if isinstance(data.get("graph"), Mapping) else None,
        senders=_each(data.get("senders"), _sender),
        devices=_each(data.get("devices"), _device),
        clock_ahead=None if time is None or received is None else time - received,
        boot_id=_text(data.get("boot_id")),
        troubles={_text(name): _text(why) for name, why in _items(data.get("troubles"))},
    )


def _unit(data: Mapping[str, Any]) -> UnitSeen:
    return UnitSeen(
        load=_text(data.get("load")),
        active=_text(data.get("active")),
        sub=_text(data.get("sub")),
        result=_text(data.get("result")),
        text=_text(data.get("text")),
        pid=_count(data.get("pid")),
        restarts=_count(data.get("restarts")),
        restarted=_count(data.get("restarted")),
        skipped=data.get("skipped") is True,
    )


def _master(data: Mapping[str, Any]) -> MasterSeen:
    return MasterSeen(
        reachable=data.get("reachable") is True,
        error=_text(data.get("error")),
        run_id=_text(data.get("run_id")),
        latency=_float_or_none(data.get("latency")) or 0.0,
    )


def _node(data: Mapping[str, Any]) -> NodeSeen:
    return NodeSeen(
        registered=_bool_or_none(data.get("registered")),
        alive=_bool_or_none(data.get("alive")),
        uri=_text(data.get("uri")),
        pid=_count(data.get("pid")),
        error=_text(data.get("error")),
        publishes={_text(name): _text(kind) for name, kind in _items(data.get("publishes"))},
        hears={_text(name): _text(kind) for name, kind in _items(data.get("hears"))},
        topics=_each(data.get("topics"), _topic),
        report=_report(data.get("reports")),
    )


def _topic(data: Mapping[str, Any]) -> TopicSeen:
    return TopicSeen(
        count=_count(data.get("count")),
        rate=_float_or_none(data.get("rate")),
        seconds=_float_or_none(data.get("seconds")) or 0.0,
        type=_text(data.get("type")),
        error=_text(data.get("error")),
    )


def _report(data: Any) -> Report | None:
    """The worst of a driver's statuses."""
    statuses = [one for one in data if isinstance(one, Mapping)] if isinstance(data, list) else []
    if not statuses:
        return None
    worst = max(statuses, key=lambda one: _count(one.get("level")))
    values = dict(_items(worst.get("values")))
    return Report(_count(worst.get("level")), _text(worst.get("message")), _text(values.get("commander")))


def _sender(data: Mapping[str, Any]) -> SenderSeen:
    publishes = {_text(name): _text(kind) for name, kind in _items(data.get("publishes"))}
    return SenderSeen(host=_text(data.get("host")).lower(), publishes=publishes)


def _graph(data: Mapping[str, Any]) -> GraphSeen:
    strangers = data.get("strangers")
    return GraphSeen(
        publishers={
            _text(topic): {_text(node): _text(uri) for node, uri in _items(found)}
            for topic, found in _items(data.get("publishers"))
        },
        types={_text(topic): _text(kind) for topic, kind in _items(data.get("types"))},
        strangers=tuple(_stranger(one) for one in strangers[:_MOST] if isinstance(one, Mapping))
        if isinstance(strangers, list)
        else (),
    )


def _stranger(data: Mapping[str, Any]) -> Stranger:
    node, uri = _text(data.get("node")), _text(data.get("uri"))
    return Stranger(node, uri, _texts(data.get("publishes")), _texts(data.get("hears")))


def _device(data: Mapping[str, Any]) -> DeviceSeen:
    return DeviceSeen(
        exists=data.get("exists") is True,
        is_device=data.get("is_device") is True,
        usable=data.get("usable") is True,
        resolves=_text(data.get("resolves")),
        group=_text(data.get("group")),
        mode=_count(data.get("mode")),
        nearby=_texts(data.get("nearby")),
    )


def _each(data: Any, make: Callable[[Mapping[str, Any]], T]) -> dict[str, T]:
    return {_text(name): make(value) for name, value in _items(data) if isinstance(value, Mapping)}


def _items(data: Any) -> list[tuple[Any, Any]]:
    return list(data.items())[:_MOST] if isinstance(data, Mapping) else []


def _texts(data: Any) -> tuple[str, ...]:
    return tuple(_text(one) for one in data[:_MOST]) if isinstance(data, list) else ()


def _text(value: Any) -> str:
    return value[:_LONGEST_TEXT] if isinstance(value, str) else ""


def _count(value: Any) -> int:
    return value if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 63 else 0


def _float_or_none(value: Any) -> float | None:
    """A number that can be calculated with: JSON also has NaN, and integers beyond any float."""
    fits = isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e15
    return float(value) if fits else None


def _bool_or_none(value: Any) -> bool | None:
    return value if isinstance(value, bool) else None
