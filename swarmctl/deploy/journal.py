"""Stores what this operator last deployed to each host, for ``plan --offline``."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from swarm_onboard.agent.host_list import HostLogin

from swarmctl.plan.observed_host import NOTHING, Observed
from swarmctl.remote import operators
from swarmctl.remote.answer_check import checked
from swarmctl.remote.transport import HostError
from swarmctl.render.manifest import ManifestData


def folder(swarm: str, environment: Mapping[str, str] = os.environ) -> Path:
    """Returns where the journal of a swarm is kept (XDG base directories: state)."""
    state = environment.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(state) / "swarmctl" / swarm


def remember(
    place: Path, host: str, digest: str, manifest: Mapping[str, Any], login: HostLogin | None = None
) -> None:
    """Store that ``host`` runs release ``digest``, and how it is reached, atomically. Raises ``OSError``."""
    place.mkdir(parents=True, exist_ok=True)
    draft = place / f".{host}.json.new"
    draft.write_text(
        json.dumps({"digest": digest, "manifest": manifest, "login": login and login._asdict()}), "utf-8"
    )
    draft.replace(place / f"{host}.json")


def forget(place: Path, host: str) -> None:
    """Store that ``host`` runs nothing of the swarm any more."""
    (place / f"{host}.json").unlink(missing_ok=True)


def rename(place: Path, host: str, new: str) -> None:
    """Store what is known of ``host`` as what is known of ``new``. Raises ``OSError``."""
    with suppress(FileNotFoundError):
        (place / f"{host}.json").replace(place / f"{new}.json")
    for lab in (False, True):
        if host in (hosts := failed(place, lab=lab)):
            remember_failed(place, [new if one == host else one for one in hosts], lab=lab)


def remember_failed(place: Path, hosts: Collection[str], *, lab: bool) -> None:
    """Store which hosts failed in the last deploy, or were held back, for ``deploy --retry-failed``."""
    place.mkdir(parents=True, exist_ok=True)
    draft = place / ".failed.new"
    draft.write_text(json.dumps(sorted(hosts)), "utf-8")
    draft.replace(_failed(place, lab=lab))


def failed(place: Path, *, lab: bool) -> list[str]:
    """Returns the hosts that failed in the last deploy from this machine, or were held back."""
    try:
        found = json.loads(_failed(place, lab=lab).read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return []
    return [one for one in found if isinstance(one, str)] if isinstance(found, list) else []


def _failed(place: Path, *, lab: bool) -> Path:
    return place / (".failed-lab" if lab else ".failed")


def remember_awaited(place: Path, hosts: Mapping[str, str], *, lab: bool) -> None:
    """Store the hosts that this process waits for to deploy to them, each with the reason."""
    file = place / f"{_awaited(lab=lab)}{os.getpid()}"
    if not hosts:
        file.unlink(missing_ok=True)
        return
    place.mkdir(parents=True, exist_ok=True)
    draft = file.with_name(f"{file.name}.new")
    draft.write_text(json.dumps({"who": operators.this_one(), "hosts": hosts}), "utf-8")
    draft.replace(file)


def awaited(place: Path, *, lab: bool) -> dict[str, str]:
    """Returns the hosts that processes of this machine wait for, each with the reason."""
    hosts: dict[str, str] = {}
    for file in sorted(place.glob(f"{_awaited(lab=lab)}*[0-9]")):
        with suppress(OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            found = json.loads(file.read_text("utf-8"))
            if operators.ended_here(found["who"]):
                file.unlink()
            else:
                hosts |= {str(host): str(why) for host, why in found["hosts"].items()}
    return hosts


def _awaited(*, lab: bool) -> str:
    return ".lab-awaited-" if lab else ".awaited-"


def left(place: Path, hosts: Collection[str]) -> list[str]:
    """Returns the hosts with a stored release that are not in ``hosts``."""
    return sorted(file.stem for file in place.glob("[!.]*.json") if file.stem not in hosts)


def login_of(place: Path, host: str) -> HostLogin | None:
    """Returns how ``host`` was reached in the last deploy from this machine; None if that is not known."""
    try:
        login = json.loads((place / f"{host}.json").read_text("utf-8"))["login"]
        return checked(login, HostLogin, "a login")
    except (OSError, ValueError, KeyError, TypeError, RecursionError, HostError):
        return None


def recall(place: Path, host: str) -> Observed:
    """Returns what ``host`` ran after the last deploy from this machine; nothing if that is not known."""
    try:
        entry = json.loads((place / f"{host}.json").read_text("utf-8"))
        manifest = checked(entry["manifest"], ManifestData, "a manifest")
        return Observed(str(entry["digest"]), manifest)
    except (OSError, ValueError, KeyError, TypeError, RecursionError, HostError):
        return NOTHING
