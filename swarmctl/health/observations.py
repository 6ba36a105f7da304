"""What a probe observed on one host, as frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class UnitSeen:
    """A systemd unit. ``restarted`` counts the restarts during the probe, ``recent`` the latest ones, and
    ``rejoined`` those of ``restarts`` that followed a new ROS master, of which none is recent.

    ``running``: for how long a unit that was restarted has run by now, s.
    ``starting``: for how long one that was not restarted has been starting, s; ``log``: the end of its log
    if it does not run.
    ``exit``: how its main process ended last; ``stopped``: processes that a signal or a debugger has stopped,
    as number and name; ``unmet``: conditions of its file that are not met, for one that is ``skipped``.
    ``unenforced``: it runs, and systemd does not enforce its list of IP addresses.
    """

    load: str
    active: str
    sub: str
    result: str
    text: str
    pid: int
    restarts: int
    restarted: int = 0
    skipped: bool = False
    recent: int = 0
    rejoined: int = 0
    running: float = 0.0
    starting: float = 0.0
    log: str = ""
    exit: str = ""
    stopped: tuple[str, ...] = ()
    unmet: tuple[str, ...] = ()
    unenforced: bool = False

    @property
    def ended(self) -> bool:
        """True if it ended by itself, and systemd starts it again or has given up."""
        return self.active == "failed" or self.sub == "auto-restart" or self.restarted > 0

    @property
    def runs(self) -> bool:
        """True if systemd reports the unit as active or reloading."""
        return self.active in ("active", "reloading")


@dataclass(frozen=True)
class ImageSeen:
    """The image of a container. ``built_for``: its architecture; ``machine``: the host's (uname(2));
    ``error``: why nothing is known of it.
    """

    there: bool
    built_for: str
    machine: str
    error: str


@dataclass(frozen=True)
class MasterSeen:
    """The master as one host sees it. ``latency`` in s; ``run_id`` differs between two runs of a master."""

    reachable: bool = False
    error: str = ""
    run_id: str = ""
    latency: float = 0.0


@dataclass(frozen=True)
class SimulatedTimeSeen:
    """What a master has of simulated time. ``used``: nodes that start now take it.

    ``count``: messages of the clock within ``seconds``; ``moved``: by how many s they moved the time, None
    without two of them; ``now``: the time of the last.
    """

    used: bool
    publishers: tuple[str, ...] = ()
    count: int = 0
    moved: float | None = None
    seconds: float = 0.0
    now: float | None = None
    error: str = ""


@dataclass(frozen=True)
class TopicSeen:
    """The messages of a topic within ``seconds``. ``rate`` in Hz, None before the second message.

    ``age``: s since the last message when the listening ended, None before the first.
    """

    count: int = 0
    rate: float | None = None
    seconds: float = 0.0
    type: str = ""
    error: str = ""
    age: float | None = None


@dataclass(frozen=True)
class Report:
    """A driver's status in /diagnostics; ``level`` as in diagnostic_msgs/DiagnosticStatus.

    ``commander`` is the one that it obeys at the moment, ``refused`` are the nodes that it rejected lately.
    ``refused_all``: no other node was. ``strangers``: those of them that may not command it, as text.
    """

    level: int
    message: str
    commander: str = ""
    refused: tuple[str, ...] = ()
    refused_all: bool = True
    strangers: str = ""


@dataclass(frozen=True)
class NodeSeen:
    """A node: whether it is registered and answers; types of what it publishes, subscribes and provides."""

    registered: bool | None = None
    alive: bool | None = None
    uri: str = ""
    pid: int = 0
    error: str = ""
    publishes: Mapping[str, str] = field(default_factory=dict)
    subscribes: Mapping[str, str] = field(default_factory=dict)
    topics: Mapping[str, TopicSeen] = field(default_factory=dict)
    report: Report | None = None
    parameters: tuple[str, ...] | None = None  # that are not as its driver set them; None: not compared
    provides: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class EndedSeen:
    """How a node of a launch file ended (empty if unknown), and after how many s, if known."""

    exit: str
    lasted: float | None = None


@dataclass(frozen=True)
class LaunchedSeen:
    """The nodes found of a unit. ``started`` are those that roslaunch runs; ``ended`` ones stay away."""

    nodes: Mapping[str, NodeSeen] = field(default_factory=dict)
    started: tuple[str, ...] = ()
    ended: Mapping[str, EndedSeen] = field(default_factory=dict)
    error: str = ""


@dataclass(frozen=True)
class ConflictSeen:
    """How often another node has taken a node's name, and how many s ago for the last time."""

    count: int
    ago: float


@dataclass(frozen=True)
class ForeignNode:
    """A node that is registered at a master, but runs on none of the island's hosts."""

    node: str
    uri: str
    publishes: tuple[str, ...]
    subscribes: tuple[str, ...]


@dataclass(frozen=True)
class GraphSeen:
    """What a hub's master lists of bridged topics: the publishers with their URIs and the type, by topic."""

    publishers: Mapping[str, Mapping[str, str]]
    types: Mapping[str, str]
    foreign: tuple[ForeignNode, ...]


@dataclass(frozen=True)
class SenderSeen:
    """A publisher: the host in its URI, what it publishes (name to type), why it does not answer."""

    host: str = ""
    publishes: Mapping[str, str] = field(default_factory=dict)
    error: str = ""


@dataclass(frozen=True)
class PeerSeen:
    """A registered node of another host, with the topics that it publishes for nodes of this one.

    ``error``: the address and ``port`` that let no connection in, and why; none if those tried let one in.
    """

    uri: str
    topics: tuple[str, ...] = ()
    port: int = 0
    error: str = ""


@dataclass(frozen=True)
class UnconnectedSeen:
    """A ``node`` that subscribes to ``topic`` and has no connection to the ``publisher`` at ``uri``.

    ``md5``: the MD5 sum of the subscriber's ``type``, and of the publisher's; empty if unknown.
    """

    node: str
    publisher: str
    uri: str
    topic: str
    type: str = ""
    md5: str = ""
    publisher_type: str = ""
    publisher_md5: str = ""


@dataclass(frozen=True)
class UnmatchedSeen:
    """A publisher and a subscriber of ``topic`` that exchange nothing: their types or the definitions of
    these differ, or ``policies`` of their QoS do not match.
    """

    topic: str
    publisher: str
    subscriber: str
    type: str
    publisher_type: str
    policies: str


@dataclass(frozen=True)
class DeviceSeen:
    """A serial device. ``usable``: drivers may open it (mode and group)."""

    exists: bool
    is_device: bool = False
    usable: bool = False
    resolves: str = ""
    group: str = ""
    mode: int = 0
    nearby: tuple[str, ...] = ()


@dataclass(frozen=True)
class LatchSeen:
    """A robot that `swarmctl stop` has stopped: who did, and when, in s since 1970 by the host's clock."""

    who: str
    since: float


@dataclass(frozen=True)
class ChangeSeen:
    """The last change of a host. ``state`` as in its record, empty without one; ``left``: s until it is
    undone without a confirmation; ``holder``: who changes the host now, or None.
    """

    state: str
    who: str
    left: float
    error: str
    holder: str | None = None


@dataclass(frozen=True)
class DriftSeen:
    """How a host deviates from its current release: by path, what is the matter."""

    files: Mapping[str, str]
    links: Mapping[str, str]
    blocks: Mapping[str, str]


@dataclass(frozen=True)
class PingSeen:
    """How many packets were ``sent`` to an address, and how many answers ``received``."""

    sent: int
    received: int


@dataclass(frozen=True)
class LoadSeen:
    """The share of the time of the probe in which the processors worked (``busy``), that in which they worked
    for the host's ``own`` processes, which is less in a container, and the ``busiest`` of these.
    """

    busy: float
    own: float = 0.0
    busiest: tuple[str, ...] = ()


@dataclass(frozen=True)
class Answer:
    """The answer of one host. A missing part could not be determined; ``troubles`` may have the reason."""

    release: str | None = None
    units: Mapping[str, UnitSeen] = field(default_factory=dict)
    master: MasterSeen | None = None
    nodes: Mapping[str, NodeSeen] = field(default_factory=dict)
    launched: Mapping[str, LaunchedSeen] = field(default_factory=dict)  # by unit
    conflicts: Mapping[str, Mapping[str, ConflictSeen]] = field(default_factory=dict)  # by unit and node
    commanders: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    receivers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    others: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # by topic
    peers: Mapping[str, PeerSeen] = field(default_factory=dict)  # by node
    unconnected: tuple[UnconnectedSeen, ...] = ()
    listening: tuple[int, ...] = ()  # ports of the host on which a process listens
    listening_udp: tuple[int, ...] = ()
    seen: int | None = None  # nodes in the graph, where nodes find each other without a master
    incomplete: bool = False  # something expected was not among them, and the graph still changed
    doubles: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # hosts, by name of several nodes
    unmatched: tuple[UnmatchedSeen, ...] = ()
    senders: Mapping[str, SenderSeen] = field(default_factory=dict)
    graph: GraphSeen | None = None
    simulated_time: SimulatedTimeSeen | None = None
    devices: Mapping[str, DeviceSeen] = field(default_factory=dict)
    environments: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # differences, by unit
    latches: Mapping[str, LatchSeen] = field(default_factory=dict)  # by robot
    clock_ahead: float | None = None  # s, against the operator's clock
    boot_id: str = ""
    change: ChangeSeen | None = None
    drift: DriftSeen | None = None
    lacks: tuple[str, ...] | None = None  # of what its release requires
    checks: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)  # by name of a host's check
    load: LoadSeen | None = None
    pings: Mapping[str, PingSeen] = field(default_factory=dict)  # by address
    images: Mapping[str, ImageSeen] = field(default_factory=dict)  # by unit
    troubles: Mapping[str, str] = field(default_factory=dict)
