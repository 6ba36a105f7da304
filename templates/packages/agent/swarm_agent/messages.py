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


#: The type of the answer by verb. A probe's (``probe_messages``) is not here, since misfits
#: count as unknown.
ANSWERS: Mapping[str, type] = {
    "observe": ObserveAnswer,
    "apply": ApplyAnswer,
    "keep_secrets": KeepSecretsAnswer,
    "remove": RemoveAnswer,
    "flash": FlashAnswer,
}
