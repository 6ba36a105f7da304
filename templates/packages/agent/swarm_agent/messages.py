"""Requests and answers of the agent's verbs, as both sides read them. JSON objects; types only.

A request without a note here names the ``swarm``; ``who`` is the operator for whoever finds the host locked,
``wait`` the seconds to wait for the lock. swarmctl checks each answer against ``ANSWERS``.
"""

from __future__ import annotations

from typing import Any, Literal, Mapping, TypedDict

from .manifest import ManifestData

FileDrift = Literal["changed", "missing", "extra", "damaged"]
LinkDrift = Literal["changed", "missing", "extra", "foreign"]
BlockDrift = Literal["changed", "missing", "extra", "broken"]
SecretState = Literal["same", "other", "new", "kept", "missing"]


class UnitState(TypedDict):
    """A systemd unit as ``systemctl show`` reports it. ``skipped``: a condition of the unit is not met."""

    load: str
    active: str
    sub: str
    result: str
    text: str
    pid: int
    restarts: int
    skipped: bool


class Locking(TypedDict, total=False):
    """``who`` holds the lock of the swarm; ``wait``: s to wait for another holder."""

    who: str
    wait: float


class ObserveNeeds(TypedDict):
    """The required keys of ``observe``."""

    verb: Literal["observe"]
    swarm: str


class ObserveRequest(ObserveNeeds, total=False):
    """What the host has, without changing anything. The payload has the values of some ``secrets`` as JSON.

    ``know``: digest of a release whose manifest need not be sent; ``contents``: send the texts of files, too;
    ``requires``: programs by name, and ROS packages and workspaces, ``package:NAME`` and ``workspace:PATH``;
    ``wants``: other programs to look for, with the state of what they manage.
    """

    know: str
    contents: bool
    requires: list[str]
    wants: list[str]
    secrets: list[str]


class Prepared(TypedDict, total=False):
    """The state of what optional programs manage: the clock, power saving by interface (`on`, `off`)."""

    clock: Literal["follows", "alone", "borrowed"]
    power_save: dict[str, str]


class FactsAlways(TypedDict):
    """The facts that every host reports."""

    hostname: str
    machine: str
    python: str
    systemd: bool
    uid: int
    boot_id: str
    time: float
    free_bytes: int
    free_inodes: int
    has: dict[str, str | None]
    absent: list[str]


class Facts(FactsAlways, Prepared, total=False):
    """The host itself. ``time`` in s since 1970; ``has``: the path of each requirement, or null; ``absent``:
    folders and files of programs that are not installed."""


class Drift(TypedDict):
    """Deviations from the manifest, by path."""

    files: dict[str, FileDrift]
    links: dict[str, LinkDrift]
    blocks: dict[str, BlockDrift]


class Transaction(TypedDict, total=False):
    """The last deploy: digests of the releases before (null: none) and after it."""

    txid: str
    state: str
    who: str
    prev: str | None
    next: str
    error: str


class ObserveAnswerAlways(TypedDict):
    """The required keys of the answer to ``observe``."""

    facts: Facts
    release: str | None
    releases: list[str]
    transaction: Transaction
    staging: list[str]
    lock: str | None
    drift: Drift
    units: dict[str, UnitState]


class ObserveAnswer(ObserveAnswerAlways, total=False):
    """``release``: digest of the current one; ``files`` and ``blocks``: texts, with ``contents`` only."""

    secrets: dict[str, SecretState]
    manifest: ManifestData
    files: dict[str, str]
    blocks: dict[str, str]


class ApplyNeeds(TypedDict):
    """The required keys of ``apply``."""

    verb: Literal["apply"]
    swarm: str
    base: str | None
    next: str
    txid: str


class ApplyRequest(ApplyNeeds, Locking, total=False):
    """Bring the host from release ``base`` to release ``next`` (digests).

    ``reload``: keys of ``paths.READERS``. The payload is a tar.gz, the manifest first; it is empty if the
    host has the release already.
    """

    stop: list[str]
    start: list[str]
    restart: list[str]
    reload: list[str]


class ApplyAnswer(TypedDict):
    """The new release, the one before, and the states of its units."""

    release: str
    previous: str | None
    units: dict[str, UnitState]


class KeepSecretsNeeds(TypedDict):
    """The required keys of ``keep_secrets``."""

    verb: Literal["keep_secrets"]
    swarm: str


class KeepSecretsRequest(KeepSecretsNeeds, Locking, total=False):
    """Store secrets for the units that read them. The payload is a JSON object, name to value."""


class KeepSecretsAnswer(TypedDict):
    """``kept``: the names of the stored secrets."""

    kept: list[str]


class RemoveNeeds(TypedDict):
    """The required keys of ``remove``."""

    verb: Literal["remove"]
    swarm: str


class RemoveRequest(RemoveNeeds, Locking, total=False):
    """Take the swarm off the host."""


class RemoveAnswer(TypedDict):
    """``removed``: whether it was there."""

    removed: bool


class FlashNeeds(TypedDict):
    """The required keys of ``flash``."""

    verb: Literal["flash"]
    swarm: str
    unit: str
    port: str
    files: list[list[Any]]
    write: list[str]
    digest: str
    patience: float


class FlashRequest(FlashNeeds, Locking, total=False):
    """Write a firmware to a robot's board while its driver ``unit`` is stopped, and wait for the board.

    ``files``: name and size of each, in the payload's order; ``write``: avrdude's command, run in their
    folder; ``digest``: of the firmware; ``patience``: s to wait until the driver logs that digest.
    """


class FlashAnswer(TypedDict):
    """``runs``: the driver ran before and runs again; ``logged``: it logged this firmware of the board."""

    runs: bool
    logged: bool


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


#: The type of the answer by verb. A probe's is not here: what does not fit in it counts as unknown.
ANSWERS: Mapping[str, type] = {
    "observe": ObserveAnswer,
    "apply": ApplyAnswer,
    "keep_secrets": KeepSecretsAnswer,
    "remove": RemoveAnswer,
    "flash": FlashAnswer,
}
