"""``observe``: what the host has, without changing anything."""

from __future__ import annotations

import glob
import json
import os
import shutil
import sys
import time
from typing import TYPE_CHECKING, Any, Iterable

from swarm_agent import (
    edits,
    files,
    lock,
    motion_gate,
    packages,
    platforms,
    preflight,
    record,
    secrets,
    system_links,
    systemd,
    upload,
)
from swarm_agent.errors import RefusedError
from swarm_agent.manifest import EMPTY, NAME, Manifest, secret_names
from swarm_agent.release_store import Home, home_of
from swarm_agent.rpc import Report

if TYPE_CHECKING:
    from swarm_agent.messages import Drift, Facts, ObserveAnswer, ObserveRequest, Transaction

LONGEST_TEXT = 64 << 10
LONGEST_TEXTS = 512 << 10
_MODULE_FOLDERS = (
    "/opt/ros/*/lib/python3/dist-packages",
    "/usr/lib/python3/dist-packages",
    "/usr/local/lib/python3*/dist-packages",
)


def handle(request: ObserveRequest, payload: bytes, report: Report) -> ObserveAnswer:
    """Returns the host's facts, its release and the states of units."""
    home = home_of(request["swarm"])
    digest = home.current()
    manifest = home.known_manifest(digest)
    answer: ObserveAnswer = {
        "facts": facts(home, request.get("requires", ()), request.get("wants", ())),
        "release": digest,
        "releases": home.releases(),
        "transaction": _transaction(home),
        "staging": os.listdir(home.staging) if os.path.isdir(home.staging) else [],
        "lock": lock.holder(home),
        "drift": _drift(home, digest, manifest),
        "units": {},
    }
    if uploaded := upload.kept(home):
        answer["uploaded"] = uploaded
    if names := secret_names(request.get("secrets", [])):
        answer["secrets"] = secrets.states(home, names, secrets.offered(payload))
    if digest is None or manifest is None:
        return answer
    if edited := edits.found(home, digest, manifest, answer["drift"]):
        answer["edits"] = edited
    if systemd.present(home):
        answer["units"] = systemd.states(manifest.units)
    if request.get("motion"):
        robots, stop = motion_gate.robots_of(home, manifest.units), bool(request.get("stop_robots"))
        answer["busy"] = motion_gate.busy(home, robots, stop=stop)
    if digest != request.get("know"):
        content = files.read(f"{home.release(digest)}/{NAME}") or b"{}"
        answer["manifest"] = json.loads(content.decode("utf-8"))
    if request.get("contents"):
        answer["files"] = _texts(home, digest, sorted(manifest.files))
        answer["blocks"] = _blocks(home)
    return answer


def _drift(home: Home, digest: str | None, manifest: Manifest | None) -> Drift:
    """Deviations from the current release; without one, or with a damaged manifest, what is left of it."""
    if digest is None or manifest is None:
        return {
            "files": {NAME: "damaged"} if manifest is None else {},
            "links": system_links.link_deviations(home, {}),
            "blocks": system_links.block_deviations(home, None, EMPTY),
        }
    return edits.drift(home, digest, manifest)


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
            **preflight.found(requires, home.outside),
            "roscore": shutil.which("roscore") or next(iter(glob.glob("/opt/ros/*/bin/roscore")), None),
            "rospy": _module("rospy"),
            "pyserial": _module("serial"),
            "tf2_msgs": _module("tf2_msgs"),
            **packages.found(requires, home.outside),
            **programs,
        },
        "absent": system_links.absent(home),
        "platform": platforms.platform(home.outside),
        **preflight.standing(programs, home.outside),
    }


def _module(name: str) -> str | None:
    """Where a Python module lies that a driver may import."""
    return next((place for folder in _MODULE_FOLDERS for place in glob.glob(f"{folder}/{name}")), None)


def _existing(path: str) -> str:
    while not os.path.isdir(path):
        path = os.path.dirname(path)
    return path


def _transaction(home: Home) -> Transaction:
    last = record.read(home)
    return {
        "txid": last.txid,
        "state": last.state,
        "who": last.who,
        "prev": last.prev,
        "next": last.next,
        "left": round(last.left(home), 1),
        "error": last.error,
    }


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
