"""``observe``: what the host has, without changing anything.

Request: ``swarm``, ``know`` (a release whose manifest need not be sent), ``contents`` (send the texts, too),
``requires`` (ROS packages and workspaces whose place is asked for: ``package:NAME``, ``workspace:PATH``),
``wants`` (other programs whose place is asked for, with how it stands with what they look after),
``secrets`` (names; the payload offers values of some, as JSON, to be compared).
Answer: ``facts``, ``release``, ``manifest``, ``releases``, ``drift`` (deviations from the current manifest),
``units``, ``transaction``, ``staging``, ``lock``, and with ``contents`` ``files`` and ``blocks``.
"""

from __future__ import annotations

import glob
import json
import os
import shutil
import sys
import time
from typing import Any, Iterable

from swarm_agent import files, lock, outside, packages, preflight, systemd, vault
from swarm_agent.errors import RefusedError
from swarm_agent.home import Home
from swarm_agent.manifest import NAME, secret_names, swarm_name
from swarm_agent.wire import Report

LONGEST_TEXT = 64 << 10
LONGEST_TEXTS = 512 << 10
_MODULE_FOLDERS = (
    "/opt/ros/*/lib/python3/dist-packages",
    "/usr/lib/python3/dist-packages",
    "/usr/local/lib/python3*/dist-packages",
)


def handle(request: dict[str, Any], payload: bytes, report: Report) -> dict[str, Any]:
    home = Home(swarm_name(request["swarm"]), os.environ.get("SWARM_PREFIX", ""))
    digest = home.current()
    answer: dict[str, Any] = {
        "facts": facts(home, request.get("requires", ()), request.get("wants", ())),
        "release": digest,
        "releases": home.releases(),
        "transaction": _transaction(home),
        "staging": os.listdir(home.staging) if os.path.isdir(home.staging) else [],
        "lock": lock.holder(home),
    }
    if names := secret_names(request.get("secrets", [])):
        answer["secrets"] = vault.states(home, names, vault.offered(payload))
    manifest = home.known_manifest(digest)
    if digest is None or manifest is None:
        damaged = {NAME: "damaged"} if manifest is None else {}
        nothing = home.manifest(None)
        answer["drift"] = {
            "files": damaged,
            "links": outside.link_deviations(home, {}),
            "blocks": outside.block_deviations(home, None, nothing),
        }
        answer["units"] = {}
        return answer
    answer["drift"] = {
        "files": home.deviations(digest, manifest),
        "links": outside.link_deviations(home, manifest.links),
        "blocks": outside.block_deviations(home, digest, manifest),
    }
    answer["units"] = systemd.states(manifest.units) if systemd.present(home) else {}
    if digest != request.get("know"):
        content = files.read(f"{home.release(digest)}/{NAME}") or b"{}"
        answer["manifest"] = json.loads(content.decode("utf-8"))
    if request.get("contents"):
        answer["files"] = _texts(home, digest, sorted(manifest.files))
        answer["blocks"] = _blocks(home)
    return answer


def facts(home: Home, requires: Iterable[str] = (), wants: Iterable[str] = ()) -> dict[str, Any]:
    """The host itself: what it runs, how much room it has, which ROS it has, what else of what is asked."""
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
            "roscore": shutil.which("roscore") or next(iter(glob.glob("/opt/ros/*/bin/roscore")), None),
            "rospy": _module("rospy"),
            "pyserial": _module("serial"),
            **packages.found(requires, home.outside),
            **programs,
        },
        "absent": outside.absent(home),
        **preflight.standing(programs, home.outside),
    }


def _module(name: str) -> str | None:
    """Where a Python module lies that a driver may import."""
    return next((place for folder in _MODULE_FOLDERS for place in glob.glob(f"{folder}/{name}")), None)


def _existing(path: str) -> str:
    while not os.path.isdir(path):
        path = os.path.dirname(path)
    return path


def _transaction(home: Home) -> dict[str, Any]:
    shown = ("txid", "state", "who", "prev", "next", "error")
    return {name: value for name, value in home.record().items() if name in shown}


def _texts(home: Home, digest: str, paths: Any) -> dict[str, str]:
    """The files as text, as many as fit."""
    texts: dict[str, str] = {}
    room = LONGEST_TEXTS
    for path in paths:
        content = (files.read(os.path.join(home.release(digest), path)) or b"")[:LONGEST_TEXT]
        room -= len(content)
        if room < 0:
            break
        texts[path] = content.decode("utf-8", "replace")
    return texts


def _blocks(home: Home) -> dict[str, str]:
    try:
        found = outside.block_texts(home)
    except RefusedError:
        return {}
    return {path: text.decode("utf-8", "replace") for path, text in found.items() if text is not None}
