"""What a probe sees on one host: of its graph, which each middleware fills in, and of the host itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .named_tuple import NamedTuple


class MasterSeen(NamedTuple):
    """The master as one host sees it. ``latency`` in s; ``run_id`` differs between two runs of a master."""

    reachable: bool = False
    error: str = ""
    run_id: str = ""
    latency: float = 0.0


class SimulatedTimeSeen(NamedTuple):
    """What a master has of simulated time. ``used``: nodes that start now take it.

    ``count``: messages of the clock within ``seconds``; ``moved``: by how many s they moved the time, None
    without two of them; ``now``: the time of the last.
    """

    used: bool
    publishers: Sequence[str] = ()
    count: int = 0  # type: ignore[assignment]  # not the method of tuples
    moved: float | None = None
    seconds: float = 0.0
    now: float | None = None
    error: str = ""


class TopicSeen(NamedTuple):
    """The messages of a topic within ``seconds``. ``rate`` in Hz, None before the second message.

    ``age``: s since the last message when the listening ended, None before the first.
    """

    count: int = 0  # type: ignore[assignment]  # not the method of tuples
    rate: float | None = None
    seconds: float = 0.0
    type: str = ""
    error: str = ""
    age: float | None = None


class Report(NamedTuple):
    """A driver's status in /diagnostics; ``level`` as in diagnostic_msgs/DiagnosticStatus.

    ``commander`` is the one that it obeys at the moment, ``refused`` are the nodes that it rejected lately.
    ``refused_all``: no other node was. ``strangers``: those of them that may not command it, as text.
    """

    level: int
    message: str
    commander: str = ""
    refused: Sequence[str] = ()
    refused_all: bool = True
    strangers: str = ""


class Status(NamedTuple):
    """One status in /diagnostics, as in diagnostic_msgs/DiagnosticStatus."""

    level: int
    name: str
    message: str
    values: Mapping[str, str]


def worst(statuses: Sequence[Status]) -> Report | None:
    """Returns the first of the worst statuses of a driver or gate."""
    if not statuses:
        return None
    one = max(statuses, key=lambda status: status.level)
    nodes = one.values.get("refused nodes", "more").split()
    return Report(
        one.level,
        one.message,
        one.values.get("commander", ""),
        [node for node in nodes if node.startswith("/")],
        all(node.startswith("/") for node in nodes),
        one.values.get("unauthorised senders", ""),
    )


class NodeSeen(NamedTuple):
    """A node: whether it is registered and answers, None if unknown; types of what it publishes, subscribes,
    and of the services and actions of the request that it provides. ``uri``: with the host that it
    advertises, empty if nodes advertise none.
    """

    registered: bool | None = None
    alive: bool | None = None
    uri: str = ""
    pid: int = 0
    error: str = ""
    publishes: Mapping[str, str] = {}
    subscribes: Mapping[str, str] = {}
    topics: Mapping[str, TopicSeen] = {}
    report: Report | None = None
    parameters: Sequence[str] | None = None  # that are not as its driver set them; None: not compared
    provides: Mapping[str, str] = {}


class EndedSeen(NamedTuple):
    """How a node of a launch file ended (empty if unknown), and after how many s, if known."""

    exit: str
    lasted: float | None = None


class LaunchedSeen(NamedTuple):
    """The nodes found of a unit. ``starts``: how often roslaunch has started each of those that it runs;
    ``ended`` ones stay away.
    """

    nodes: Mapping[str, NodeSeen] = {}
    starts: Mapping[str, int] = {}
    ended: Mapping[str, EndedSeen] = {}
    error: str = ""


class ConflictSeen(NamedTuple):
    """How often another node has taken a node's name, and how many s ago for the last time."""

    count: int  # type: ignore[assignment]  # not the method of tuples
    ago: float


class ForeignNode(NamedTuple):
    """A node that is registered at a master, but runs on none of the island's hosts."""

    node: str
    uri: str
    publishes: Sequence[str]
    subscribes: Sequence[str]


class GraphSeen(NamedTuple):
    """What a hub's master lists of bridged topics: the publishers with their URIs and the type, by topic."""

    publishers: Mapping[str, Mapping[str, str]]
    types: Mapping[str, str]
    foreign: Sequence[ForeignNode]


class SenderSeen(NamedTuple):
    """A publisher: the host in its URI, what it publishes (name to type), why it does not answer."""

    host: str = ""
    publishes: Mapping[str, str] = {}
    error: str = ""


class PeerSeen(NamedTuple):
    """A registered node of another host, with the topics that it publishes for nodes of this one.

    ``error``: the address and ``port`` that let no connection in, and why; none if those tried let one in.
    """

    uri: str
    topics: Sequence[str] = ()
    port: int = 0
    error: str = ""


class UnconnectedSeen(NamedTuple):
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


class UnmatchedSeen(NamedTuple):
    """A publisher and a subscriber of ``topic`` that exchange nothing: their types or the definitions of
    these differ, or ``policies`` of their QoS do not match.
    """

    topic: str
    publisher: str
    subscriber: str
    type: str
    publisher_type: str
    policies: str


class DeviceSeen(NamedTuple):
    """A serial device. ``usable``: drivers may open it (mode and group)."""

    exists: bool
    is_device: bool = False
    usable: bool = False
    resolves: str = ""
    group: str = ""
    mode: int = 0
    nearby: Sequence[str] = ()


class PingSeen(NamedTuple):
    """How many packets were ``sent`` to an address, and how many answers ``received``."""

    sent: int
    received: int


class LoadSeen(NamedTuple):
    """The share of the time of the probe in which the processors worked (``busy``), that in which they worked
    for the host's ``own`` processes, which is less in a container, and the ``busiest`` of these.
    """

    busy: float
    own: float = 0.0
    busiest: Sequence[str] = ()
