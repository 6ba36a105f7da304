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
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.manifest import NAME, secret_names
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.tunnel import keys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterable

    from swarm_onboard.agent.messages import Facts, ObserveAnswer, ObserveRequest

LONGEST_TEXT = 64 << 10
LONGEST_TEXTS = 512 << 10


def handle(request: ObserveRequest, payload: bytes, report: Report) -> ObserveAnswer:
    """Returns the host's facts, its release and the states of units."""
    home = home_of(request["swarm"])
    last = deployed.last_change(home)  # first: what follows then differs from it only by a later change
    digest = home.current()
    manifest = home.known_manifest(digest)
    answer: ObserveAnswer = {
        "facts": facts(home, request.get("requires", ()), request.get("wants", ())),
        "release": digest,
        "releases": home.releases(),
        "transaction": last,
        "staging": os.listdir(home.staging) if os.path.isdir(home.staging) else [],
        "lock": lock.holder(home),
        "drift": deployed.drift(home, digest, manifest),
        "units": {},
    }
    if uploaded := upload.kept(home):
        answer["uploaded"] = uploaded
    if foreign := system_links.foreign_units(home, manifest.units if manifest else ()):
        answer["foreign_units"] = foreign
    if listed := host_list.state(home):
        answer["host_list"] = listed
    if news := keys.news(known_keys.known(home), str(request.get("wireguard_keys", ""))):
        answer["wireguard_keys"] = news
    if names := secret_names(request.get("secrets", [])):
        answer["secrets"] = secrets.states(home, names, secrets.offered(payload))
    if digest is None or manifest is None:
        return answer
    edited, texts = edits.found(home, digest, manifest, answer["drift"])
    if edited:
        answer["edits"], answer["edit_texts"] = edited, texts
    if systemd.present(home):
        answer["units"] = systemd.states(manifest.units)
    if request.get("motion"):
        robots, stop = motion_gate.robots_of(home, manifest.units), bool(request.get("stop_robots"))
        answer["busy"] = motion_gate.busy(home, robots, stop=stop)
    if digest != request.get("known_release"):
        content = files.read(f"{home.release(digest)}/{NAME}") or b"{}"
        answer["manifest"] = json_text.loads(content.decode("utf-8"))
    if request.get("contents"):
        answer["files"] = _texts(home, digest, sorted(manifest.files))
        answer["blocks"] = _blocks(home)
    return answer


def facts(home: Home, requires: Iterable[str] = (), wants: Iterable[str] = ()) -> Facts:
    """The host itself: its system, its free space, its ROS, and which of the requirements it has."""
    programs = preflight.found(wants, home.outside)
    machine = os.uname()
    space = os.statvfs(_existing(home.path))
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
        boot = file.read().strip()
    return {
        "hostname": machine.nodename,
        "machine": machine.machine,
        "python": sys.version.split()[0],
        "systemd": systemd.present(home),
        "uid": os.geteuid(),
        "boot_id": boot,
        "time": round(time.time(), 3),
        "free_bytes": space.f_bavail * space.f_frsize,
        "free_inodes": space.f_favail,
        "has": {
            **requirements.found(requires, home.outside),
            **programs,
        },
        "absent": system_links.absent(home),
        "platform": platforms.platform(home.outside),
        **preflight.standing(programs, home.outside),
    }


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
