"""Request and answer of ``probe``, with what a middleware's own module fills in. JSON objects; types only."""

from __future__ import annotations

from typing import Any, Literal, TypedDict


class NodeRequest(TypedDict):
    """A node to probe; ``topics``: seconds to listen to each."""

    name: str
    topics: dict[str, float]


class GraphRequest(TypedDict):
    """``topics`` that are bridged here; ``own``: addresses and names of this island's hosts."""

    topics: list[str]
    own: list[str]


class ProbeRequest(TypedDict):
    """The state of the host's part of the swarm, without changing or joining anything.

    ``module``: its ``observe(request, answer)`` fills in the ``GraphAnswer``; ``master``: its URI, empty
    without one; ``commands``: topics whose publishers are looked up; ``graph``: null on one island.
    """

    verb: Literal["probe"]
    swarm: str
    module: str
    units: list[str]
    master: str
    nodes: list[NodeRequest]
    graph: GraphRequest | None
    commands: list[str]
    devices: list[str]


class MasterAnswer(TypedDict, total=False):
    """``latency`` in s; ``run_id`` differs between two runs of a master; ``error`` if it is not reachable."""

    reachable: bool
    pid: int
    run_id: str
    latency: float
    error: str


class TopicAnswer(TypedDict):
    """The messages of a topic within ``seconds``. ``rate`` in Hz, null before the second message."""

    count: int
    rate: float | None
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

    ``publishes`` and ``subscribes``: type by topic; ``topics``: those of the request; ``uri``: with the host
    that it advertises, missing if nodes advertise none.
    """

    registered: bool | None
    alive: bool | None
    error: str
    uri: str
    pid: int
    publishes: dict[str, str]
    subscribes: dict[str, str]
    topics: dict[str, TopicAnswer]
    reports: list[StatusAnswer]


class SenderAnswer(TypedDict, total=False):
    """A publisher of command topics: its host, and which of these topics it publishes as what type."""

    host: str
    publishes: dict[str, str]
    error: str


class StrangerAnswer(TypedDict):
    """A node whose URI names no host of this island, with the topics that it has here."""

    node: str
    uri: str
    publishes: list[str]
    subscribes: list[str]


class IslandsAnswer(TypedDict):
    """``publishers`` of bridged topics: by topic the URI of each node; ``types``: by topic."""

    publishers: dict[str, dict[str, str]]
    types: dict[str, str]
    strangers: list[StrangerAnswer]


class GraphAnswer(TypedDict, total=False):
    """What the module of a middleware finds out, by node and by topic. Missing: it could not, or has none.

    ``troubles``: the reasons, by part: ``ros``, ``commanders``, ``graph``.
    """

    master: MasterAnswer
    nodes: dict[str, NodeAnswer]
    commanders: dict[str, list[str]]
    senders: dict[str, SenderAnswer]
    graph: IslandsAnswer
    troubles: dict[str, str]


class ProbeAnswer(GraphAnswer, total=False):
    """A part that fails is missing or null, and ``troubles`` has the reason."""

    release: str | None
    units: dict[str, Any] | None
    devices: dict[str, Any] | None
    time: float
    boot_id: str | None
