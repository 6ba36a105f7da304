"""What a probe saw on one host, as frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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
