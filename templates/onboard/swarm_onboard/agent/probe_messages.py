"""Request and answer of ``probe``, with what a middleware's own module fills in. JSON objects; types only."""

from __future__ import annotations

from typing import Any, Literal, TypedDict

from .edits import Drift
from .images import Image


class ListenRequest(TypedDict):
    """A node to probe; ``topics``: seconds to listen to each."""

    name: str
    topics: dict[str, float]


class NodeRequest(ListenRequest, total=False):
    """``parameters``: those that the node has set, to be compared with what the master has."""

    parameters: dict[str, Any]


class GraphRequest(TypedDict):
    """``topics`` that are bridged here, null for all; ``own``: addresses and names of this island's hosts."""

    topics: list[str] | None
    own: list[str]


class EndsRequest(TypedDict):
    """The topics that a node, or some node of a unit, publishes and subscribes to, and the services and
    actions that it provides.
    """

    publishes: list[str]
    subscribes: list[str]
    provides: list[str]


class ProbeRequest(TypedDict):
    """The state of the host's part of the swarm, without changing or joining anything.

    ``module``: its ``observe(request, answer)`` fills in the ``GraphAnswer``, its ``observe_logs(answer)``
    the conflicts, after the last states of the units; ``master``: its URI, empty without one; ``commands``:
    topics whose publishers and subscribers are looked up, with those of all topics that have one of
    ``command_types``; ``publishers``: by topic, the nodes that should publish it; ``homes``: by node of the
    island, the address at which it should be, empty but on the hub; ``peers``: nodes on other hosts to which
    the master here connects; ``expected``: by node, or by unit whose nodes have no known names, what is
    waited for where nodes find each other without a master; ``inputs``: topics to whose publishers nodes of
    this one connect; ``provides``: services and actions that nodes of this host should have; ``graph``: null
    on one island; ``launched``: units whose nodes are to be found, each with what these have, and the seconds
    to listen to that (0: not at all); ``advertised``: the host in the URIs of this
    host's nodes; ``restart_window``: s in which restarts count; ``images``: those of containers, by unit,
    each with its engine;
    ``checks``: modules of swarm_onboard.host_checks; ``clock``: s to listen to the clock of simulated time, 0
    where time is not simulated, null where the host runs no master; ``pings``: addresses of other hosts, with
    the s for which they are pinged; ``requires``: what the units of the release need to start.
    """

    verb: Literal["probe"]
    swarm: str
    module: str
    units: list[str]
    master: str
    nodes: list[NodeRequest]
    graph: GraphRequest | None
    commands: list[str]
    command_types: list[str]
    publishers: dict[str, list[str]]
    homes: dict[str, str]
    peers: list[str]
    expected: dict[str, EndsRequest]
    inputs: list[str]
    provides: list[str]
    devices: list[str]
    launched: dict[str, dict[str, float]]
    advertised: str
    restart_window: float
    images: dict[str, tuple[str, str]]
    checks: list[str]
    clock: float | None
    pings: dict[str, float]
    requires: list[str]


class MasterAnswer(TypedDict, total=False):
    """``latency`` in s; ``run_id`` differs between two runs of a master; ``error`` if it is not reachable."""

    reachable: bool
    pid: int
    run_id: str
    latency: float
    error: str


class TopicAnswer(TypedDict):
    """The messages of a topic within ``seconds``. ``rate`` in Hz, null before the second message.

    ``age``: s since the last message when the listening ended, null before the first.
    """

    count: int
    rate: float | None
    age: float | None
    seconds: float
    type: str
    error: str


class StatusAnswer(TypedDict):
    """A status that a node reports; ``level`` as in diagnostic_msgs/DiagnosticStatus."""

    level: int
    name: str
    message: str
    hardware: str
    values: dict[str, str]


class NodeAnswer(TypedDict, total=False):
    """A node. ``registered``: the graph has it; ``alive``: it answers; null is unknown.

    ``publishes`` and ``subscribes``: type by topic; ``provides``: type by service or action of the request,
    empty if unknown; ``topics``: those of the request; ``uri``: with the host
    that it advertises, missing if nodes advertise none; ``parameters``: what of them is not as in the
    request, in words.
    """

    registered: bool | None
    alive: bool | None
    error: str
    uri: str
    pid: int
    publishes: dict[str, str]
    subscribes: dict[str, str]
    provides: dict[str, str]
    topics: dict[str, TopicAnswer]
    reports: list[StatusAnswer]
    parameters: list[str]


class EndedAnswer(TypedDict):
    """A node of a launch file that has ended: how (empty if unknown), and after how many s, if known."""

    exit: str
    lasted: float | None


class LaunchedAnswer(TypedDict, total=False):
    """The nodes of a unit; ``starts`` of those that roslaunch runs; those that have ended and stay away."""

    nodes: dict[str, NodeAnswer]
    starts: dict[str, int]
    ended: dict[str, EndedAnswer]
    error: str


class ConflictAnswer(TypedDict):
    """How often another node has taken a node's name, and how many s ago for the last time."""

    count: int
    ago: float


class SenderAnswer(TypedDict, total=False):
    """A publisher of topics that were looked up: its host in lower case, and which of them it publishes as
    what type.

    ``error``: why it does not answer.
    """

    host: str
    publishes: dict[str, str]
    error: str


class StrangerAnswer(TypedDict):
    """A node whose URI names no host of this island, with the topics that it has here."""

    node: str
    uri: str
    publishes: list[str]
    subscribes: list[str]


class PeerAnswer(TypedDict):
    """A registered node of another host: its URI, and the ``inputs`` that it publishes.

    ``error``: the address and ``port`` that let no connection in, and why; none if those tried let one in.
    """

    uri: str
    topics: list[str]
    port: int
    error: str


class UnconnectedAnswer(TypedDict):
    """A ``node`` of this host that subscribes to ``topic`` and has no connection to a ``publisher`` of it.

    ``uri``: that of the publisher; ``md5``: the MD5 sum of the subscriber's ``type``, and of the publisher's;
    empty where they are unknown.
    """

    node: str
    publisher: str
    uri: str
    topic: str
    type: str
    md5: str
    publisher_type: str
    publisher_md5: str


class UnmatchedAnswer(TypedDict):
    """A publisher and a subscriber of ``topic`` that exchange nothing: their types or the definitions of
    these differ, or, in words, ``policies`` of their QoS do not match.
    """

    topic: str
    publisher: str
    subscriber: str
    type: str
    publisher_type: str
    policies: str


class IslandsAnswer(TypedDict):
    """``publishers`` of bridged topics: by topic the URI of each node; ``types``: by topic."""

    publishers: dict[str, dict[str, str]]
    types: dict[str, str]
    strangers: list[StrangerAnswer]


class SimulatedTimeUse(TypedDict):
    """``used``: nodes that start now take simulated time."""

    used: bool


class SimulatedTimeAnswer(SimulatedTimeUse, total=False):
    """More than its use is there if the clock was listened to: its ``publishers``, the messages within
    ``seconds`` of the first of them, by how many s they ``moved`` the time (null without two of them), the
    time ``now``.
    """

    publishers: list[str]
    count: int
    moved: float | None
    seconds: float
    error: str
    now: float


class GraphAnswer(TypedDict, total=False):
    """What the module of a middleware finds out, by node and by topic. Missing: it could not, or has none.

    ``others``: nodes that publish a topic and should not; ``listening`` and ``listening_udp``: the ports of
    this host with a process; ``launched``: by unit; ``conflicts``: by unit and node. Where nodes find each
    other: ``seen``, how many this host sees; ``incomplete``: something expected was not among them, and the
    graph still changed; ``doubles``: by name that several nodes have at once, the host
    of each, empty if unknown; ``unmatched``.
    ``troubles``: the reasons, by part: ``ros``, ``commanders``, ``graph``, ``peers``, ``launched``,
    ``conflicts``, ``simulated time``.
    """

    master: MasterAnswer
    nodes: dict[str, NodeAnswer]
    commanders: dict[str, list[str]]
    receivers: dict[str, list[str]]
    others: dict[str, list[str]]
    peers: dict[str, PeerAnswer]
    listening: list[int]
    listening_udp: list[int]
    seen: int
    incomplete: bool
    doubles: dict[str, list[str]]
    unmatched: list[UnmatchedAnswer]
    unconnected: list[UnconnectedAnswer]
    senders: dict[str, SenderAnswer]
    graph: IslandsAnswer
    simulated_time: SimulatedTimeAnswer
    launched: dict[str, LaunchedAnswer]
    conflicts: dict[str, dict[str, ConflictAnswer]]
    troubles: dict[str, str]


class PingAnswer(TypedDict):
    """How many packets were ``sent`` to an address, and how many answers ``received``."""

    sent: int
    received: int


class LoadAnswer(TypedDict):
    """The share of the time of the probe in which the processors worked (``busy``), that in which they worked
    for processes that the host sees (``own``), and the names of the ``busiest``.
    """

    busy: float
    own: float
    busiest: list[str]


class HistoryAnswer(TypedDict):
    """The ``recent`` restarts of a unit, how it ended last, and ``since`` when (s since 1970) that counts.

    ``rejoined``: those since its last start by hand or by a deploy that followed a new ROS master.

    ``running``: for how long a unit that was restarted has run by now, s; 0 if it does not run.
    ``starting``: for how long one that was not restarted has been starting, s; else 0. ``log``: the end of
    the log of a unit that does not run.
    """

    recent: int
    rejoined: int
    exit: str
    since: float
    running: float
    starting: float
    log: str


class ProbedUnit(TypedDict):
    """A unit, as ``systemd.UnitState``."""

    load: str
    active: str
    sub: str
    result: str
    text: str
    pid: int
    restarts: int
    skipped: bool
    unmet: list[str]
    unenforced: bool
    restarted: int


class DeviceExists(TypedDict):
    """Whether a serial device is there."""

    exists: bool


class DeviceAnswer(DeviceExists, total=False):
    """A device where ``resolves`` leads, or why there is none (``error``) and which others are ``nearby``.

    ``usable``: drivers may open it (mode and group).
    """

    error: str
    nearby: list[str]
    resolves: str
    is_device: bool
    usable: bool
    group: str
    mode: int


class LatchAnswer(TypedDict):
    """A latch of `swarmctl stop`."""

    who: str
    since: float


class ChangeAnswer(TypedDict):
    """The last change, as ``deployed.Transaction``, and who holds the lock now (null: nobody)."""

    txid: str
    state: str
    who: str
    previous: str | None
    next: str | None
    left: float
    error: str
    holder: str | None


class ProbeAnswer(GraphAnswer, total=False):
    """A part that fails is missing or null, and ``troubles`` has the reason.

    ``stopped``: by unit, the processes that a signal or a debugger has stopped; ``environments``: by unit, in
    words, which ROS variables of its main process differ from the release; ``latches``: by robot that
    `swarmctl stop` has stopped, who did and when, in s since 1970; ``drift``: from the current release;
    ``checks``: what those in the request have observed; ``lacks``: what it requires and the host has not.
    """

    release: str | None
    units: dict[str, ProbedUnit] | None
    history: dict[str, HistoryAnswer] | None
    stopped: dict[str, list[str]] | None
    environments: dict[str, list[str]] | None
    images: dict[str, Image] | None
    devices: dict[str, DeviceAnswer] | None
    latches: dict[str, LatchAnswer] | None
    change: ChangeAnswer | None
    drift: Drift | None
    lacks: list[str] | None
    checks: dict[str, list[Any]]
    load: LoadAnswer | None
    pings: dict[str, PingAnswer] | None
    time: float
    boot_id: str | None
