"""Requests and answers of the agent's verbs, as both sides read them. JSON objects; types only.

A request without a note here names the ``swarm``; ``who`` is the operator for whoever finds the host locked,
``wait`` the seconds to wait for the lock. swarmctl checks each answer (see ``answers``).
"""

from __future__ import annotations

from typing import Any, Literal, TypedDict

from .host_list_messages import HostListState
from .manifest_json import ManifestData

FileDrift = Literal["changed", "missing", "extra", "damaged"]
LinkDrift = Literal["changed", "missing", "extra", "foreign"]
BlockDrift = Literal["changed", "missing", "extra", "broken"]
SecretState = Literal["same", "other", "new", "kept", "missing"]


class UnitState(TypedDict):
    """A systemd unit as ``systemctl show`` reports it. ``skipped``: a condition of the unit is not met;
    ``unmet``: those that are not met now, such as ``ConditionPathExists=/sys/class/bluetooth/hci0``.
    ``unenforced``: it runs, and systemd does not enforce its ``IPAddressDeny=``."""

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


class Locking(TypedDict, total=False):
    """``who`` holds the lock of the swarm; ``wait``: s to wait for another holder; ``run``: the run of
    swarmctl that has the lease of the swarm; ``stop_robots``: stop robots that move or are under command
    where a change would touch them, instead of refusing it."""

    who: str
    wait: float
    run: str
    stop_robots: bool


class ObserveNeeds(TypedDict):
    """The required keys of ``observe``."""

    verb: Literal["observe"]
    swarm: str


class ObserveRequest(ObserveNeeds, total=False):
    """What the host has, without changing anything. The payload has the values of some ``secrets`` as JSON.

    ``known_release``: digest of a release whose manifest need not be sent; ``contents``: send texts of files;
    ``requires``: programs by name, and ROS packages and workspaces, ``package:NAME`` and ``workspace:PATH``;
    ``wants``: other programs to look for, with the state of what they manage; ``motion``: why robots must
    not be touched now is wanted, too; ``stop_robots``: as far as stopping them first does not change it;
    ``wireguard_keys``: public ones, as ``wireguard_key`` has them in ``known``.
    """

    known_release: str
    contents: bool
    requires: list[str]
    wants: list[str]
    secrets: list[str]
    motion: bool
    stop_robots: bool
    wireguard_keys: str


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
    folders and files of programs that are not installed; ``platform``: as in ``platforms.platform``."""

    platform: str


class Drift(TypedDict):
    """Deviations from the manifest, by path."""

    files: dict[str, FileDrift]
    links: dict[str, LinkDrift]
    blocks: dict[str, BlockDrift]


class Transaction(TypedDict):
    """The last deploy: digests of the releases before and after it (null: none). ``state`` as in ``record``,
    empty without one; ``left``: s until it is undone without a confirmation; ``error``: why it was undone."""

    txid: str
    state: str
    who: str
    previous: str | None
    next: str | None
    left: float
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
    """``release``: digest of the current one; ``files`` and ``blocks``: texts, with ``contents`` only;
    ``busy``: why robots must not be touched now, by robot, with ``motion`` only; ``uploaded``: the SHA-256 of
    files that an upload which ended early has left; ``edits``: of what people have edited, by path;
    ``edit_texts``: those texts, as far as they fit; ``foreign_units``: named as units of the swarm, and of no
    release; ``host_list``: its list of the swarm's hosts; ``wireguard_keys``: hosts of which
    it does not know a key, or not that it is retired."""

    edits: dict[str, str]
    edit_texts: dict[str, str]
    secrets: dict[str, SecretState]
    busy: dict[str, str]
    uploaded: list[str]
    foreign_units: list[str]
    host_list: HostListState
    wireguard_keys: list[str]
    manifest: ManifestData
    files: dict[str, str]
    blocks: dict[str, str]


class LeaseNeeds(TypedDict):
    """The required keys of ``lease``."""

    verb: Literal["lease"]
    swarm: str
    want: bool


class LeaseRequest(LeaseNeeds, Locking, total=False):
    """Give or renew the lease of the swarm on this host to ``run``, or with ``want`` false take it back.

    ``breaks``: a run that has ended, whose lease does not count; ``pending``: the change of this run that
    waits, and has ``confirm_within`` s from now.
    """

    breaks: str
    pending: str
    confirm_within: float


class LeaseAnswer(TypedDict):
    """``granted``: ``run`` has the lease; if not, the run and the operator that have it, for ``left`` s;
    ``last``: the last transaction of the host, which ``last_who`` began."""

    granted: bool
    epoch: int
    run: str
    who: str
    left: float
    last: str
    last_who: str


class ApplyNeeds(TypedDict):
    """The required keys of ``apply``."""

    verb: Literal["apply"]
    swarm: str
    previous: str | None
    next: str
    txid: str


class ApplyRequest(ApplyNeeds, Locking, total=False):
    """Bring the host from release ``previous`` to release ``next`` (digests).

    ``reload``: keys of ``paths.READERS``; ``reload_units``: drivers that take their parameter file while they
    run; ``confirm_within``: s until it is undone unless it is confirmed, 0:
    no confirmation is needed; ``files_only``: nothing else changes, and it stays at once;
    ``wireguard_keys``: public ones that it keeps, whatever becomes of the change.
    The payload begins with new values of secrets, a JSON object by name of ``secrets`` bytes. A tar.gz
    follows, the manifest first, without files whose contents release ``previous`` has; it is empty if the
    host has the release already.
    """

    stop: list[str]
    start: list[str]
    restart: list[str]
    reload: list[str]
    reload_units: list[str]
    confirm_within: float
    secrets: int
    files_only: bool
    wireguard_keys: str


class ApplyAnswer(TypedDict):
    """The new release, and the one before."""

    release: str
    previous: str | None


class RollbackNeeds(TypedDict):
    """The required keys of ``rollback``."""

    verb: Literal["rollback"]
    swarm: str
    previous: str | None
    next: str
    secrets: str
    txid: str


class RollbackRequest(RollbackNeeds, Locking, total=False):
    """Bring the host from release ``previous`` to ``next`` with its set ``secrets``, empty for none; it has
    kept both. It answers as ``apply``."""

    confirm_within: float


class HoldNeeds(TypedDict):
    """The required keys of ``hold``."""

    verb: Literal["hold"]
    swarm: str
    txid: str
    seconds: float
    within: float


class HoldRequest(HoldNeeds, Locking, total=False):
    """Wait until the units of the pending change ``txid`` have run for ``seconds`` without a restart, at most
    ``within`` s. If they do not, or its agent has died, the change is undone."""


class HoldAnswer(TypedDict):
    """The states of the units of the release."""

    units: dict[str, UnitState]


class WireguardKeyNeeds(TypedDict):
    """The required keys of ``wireguard_key``."""

    verb: Literal["wireguard_key"]
    swarm: str


class WireguardKeyRequest(WireguardKeyNeeds, total=False):
    """The public WireGuard key of the host in a swarm; without a private one it makes one.

    ``known``: public keys of hosts that it keeps, in lines of ``tunnel.keys``; ``make_next``: the key to
    change to is wanted, too; ``use``: that one, whose public key this is, takes the place of its key;
    ``expel``: a host whose keys are retired here.
    """

    known: str
    expel: str
    make_next: bool
    use: str


class WireguardKeyAnswer(TypedDict):
    """The public key in base64, and the next one, empty if there is none."""

    public: str
    next: str


class ConfirmNeeds(TypedDict):
    """The required keys of ``confirm`` and ``undo``."""

    verb: Literal["confirm", "undo"]
    swarm: str
    txid: str


class ConfirmRequest(ConfirmNeeds, Locking, total=False):
    """``confirm``: the pending change ``txid`` stays; ``undo``: it, or an interrupted one, is undone.

    ``pending``: false if it was not pending when the operator looked; then it is not undone if it is now.
    """

    pending: bool


class ConfirmAnswer(TypedDict):
    """The current release; null: none."""

    release: str | None


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
