"""``observe``: what the host has, without changing anything."""

from __future__ import annotations

import os
import sys
import time

from swarm_onboard.agent import (
    deployed,
    edits,
    files,
    host_list,
    json_text,
    known_keys,
    lock,
    motion_gate,
    platforms,
    preflight,
    requirements,
    secrets,
    system_links,
    systemd,
    upload,
)
from swarm_onboard.agent.deployed import Transaction
from swarm_onboard.agent.edits import Drift
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.host_list import HostListState
from swarm_onboard.agent.manifest import NAME, secret_names
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.tunnel import keys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterable, Literal, Sequence

LONGEST_TEXT = 64 << 10
LONGEST_TEXTS = 512 << 10


class Request(NamedTuple):
    """What the host has, without changing anything. The payload has the values of some ``secrets`` as JSON.

    ``known_release``: digest of a release whose manifest need not be sent; ``contents``: send texts of files;
    ``requires``: programs by name, and ROS packages and workspaces, ``package:NAME`` and ``workspace:PATH``;
    ``wants``: other programs to look for, with the state of what they manage; ``motion``: why robots must
    not be touched now is wanted, too; ``stop_robots``: as far as stopping them first does not change it;
    ``wireguard_keys``: public ones, as ``wireguard_key`` has them in ``known``.
    """

    swarm: str
    known_release: str = ""
    contents: bool = False
    requires: Sequence[str] = ()
    wants: Sequence[str] = ()
    secrets: Sequence[str] = ()
    motion: bool = False
    stop_robots: bool = False
    wireguard_keys: str = ""


class Facts(NamedTuple):
    """The host itself. ``time`` in s since 1970; ``has``: the path of each requirement, or null; ``absent``:
    folders and files of programs that are not installed; ``platform``: as in ``platforms.platform``;
    ``clock`` and ``power_save``, by interface: the state of what optional programs manage, null without the
    program."""

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
    platform: str
    clock: Literal["follows", "alone", "borrowed"] | None
    power_save: dict[str, str] | None


class Answer(NamedTuple):
    """``release``: digest of the current one; ``manifest``: its own, unless it is known; ``uploaded``: the
    SHA-256 of files that an upload which ended early has left; ``foreign_units``: named as units of the
    swarm, and of no release; ``host_list``: its list of the swarm's hosts; ``wireguard_keys``: hosts of which
    it does not know a key, or not that it is retired; ``edits``: of what people have edited, by path;
    ``edit_texts``: those texts, as far as they fit; ``busy``: why robots must not be touched now, by robot,
    with ``motion`` only; ``files`` and ``blocks``: texts, with ``contents`` only."""

    facts: Facts
    release: str | None
    releases: list[str]
    transaction: Transaction
    staging: list[str]
    lock: str | None
    drift: Drift
    uploaded: list[str]
    foreign_units: list[str]
    host_list: HostListState | None
    wireguard_keys: list[str]
    secrets: dict[str, Literal["same", "other", "new", "kept", "missing"]]
    edits: dict[str, str]
    edit_texts: dict[str, str]
    units: dict[str, UnitState]
    busy: dict[str, str]
    manifest: Any
    files: dict[str, str]
    blocks: dict[str, str]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the host's facts, its release and the states of units."""
    home = home_of(request.swarm)
    last = deployed.last_change(home)  # first: what follows then differs from it only by a later change
    digest = home.current()
    manifest = home.known_manifest(digest)
    names = secret_names(request.secrets)
    answer = Answer(
        facts(home, request.requires, request.wants),
        digest,
        home.releases(),
        last,
        os.listdir(home.staging) if os.path.isdir(home.staging) else [],
        lock.holder(home),
        deployed.drift(home, digest, manifest),
        upload.kept(home),
        system_links.foreign_units(home, manifest.units if manifest else ()),
        host_list.state(home),
        keys.news(known_keys.known(home), str(request.wireguard_keys)),
        secrets.states(home, names, secrets.offered(payload)) if names else {},
        *({}, {}, {}, {}, None, {}, {}),
    )
    if digest is None or manifest is None:
        return answer
    edited, texts = edits.found(home, digest, manifest, answer.drift)
    answer = answer._replace(edits=edited, edit_texts=texts)
    if systemd.present(home):
        answer = answer._replace(units=systemd.states(manifest.units))
    if request.motion:
        robots = motion_gate.robots_of(home, manifest.units)
        answer = answer._replace(busy=motion_gate.busy(home, robots, stop=bool(request.stop_robots)))
    if digest != request.known_release:
        content = files.read(f"{home.release(digest)}/{NAME}") or b"{}"
        answer = answer._replace(manifest=json_text.loads(content.decode("utf-8")))
    if request.contents:
        paths = sorted(manifest.files)
        answer = answer._replace(files=_texts(home, digest, paths), blocks=_blocks(home))
    return answer


def facts(home: Home, requires: Iterable[str] = (), wants: Iterable[str] = ()) -> Facts:
    """The host itself: its system, its free space, its ROS, and which of the requirements it has."""
    programs = preflight.found(wants, home.outside)
    machine = os.uname()
    space = os.statvfs(_existing(home.path))
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
        boot = file.read().strip()
    return Facts(
        machine.nodename,
        machine.machine,
        sys.version.split()[0],
        systemd.present(home),
        os.geteuid(),
        boot,
        round(time.time(), 3),
        space.f_bavail * space.f_frsize,
        space.f_favail,
        {**requirements.found(requires, home.outside), **programs},
        system_links.absent(home),
        platforms.platform(home.outside),
        preflight.clock() if "chronyd" in programs else None,
        preflight.power_save(programs["iw"], home.outside) if "iw" in programs else None,
    )


def _existing(path: str) -> str:
    while not os.path.isdir(path):
        path = os.path.dirname(path)
    return path


def _texts(home: Home, digest: str, paths: Any) -> dict[str, str]:
    """The files as text, as many as fit."""
    texts: dict[str, str] = {}
    free = LONGEST_TEXTS
    for path in paths:
        content = (files.read(os.path.join(home.release(digest), path)) or b"")[:LONGEST_TEXT]
        free -= len(content)
        if free < 0:
            break
        texts[path] = content.decode("utf-8", "replace")
    return texts


def _blocks(home: Home) -> dict[str, str]:
    try:
        found = system_links.block_texts(home)
    except RefusedError:
        return {}
    return {path: text.decode("utf-8", "replace") for path, text in found.items() if text is not None}
