"""What this operator last deployed to each host, for plans made without a network."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from swarmctl.plan.observed import NOTHING, Observed


def folder(swarm: str, environment: Mapping[str, str] = os.environ) -> Path:
    """Where the journal of a swarm is kept (XDG base directories: state)."""
    state = environment.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(state) / "swarmctl" / swarm


def remember(place: Path, host: str, digest: str, manifest: Mapping[str, Any]) -> None:
    """Note that ``host`` runs release ``digest``. Old or new on the disk, never a part."""
    place.mkdir(parents=True, exist_ok=True)
    draft = place / f".{host}.json.new"
    draft.write_text(json.dumps({"digest": digest, "manifest": manifest}), "utf-8")
    draft.replace(place / f"{host}.json")


def forget(place: Path, host: str) -> None:
    """Note that ``host`` runs nothing of the swarm any more."""
    (place / f"{host}.json").unlink(missing_ok=True)


def left(place: Path, hosts: Collection[str]) -> list[str]:
    """The hosts that the swarm was deployed to from here and that are not among ``hosts`` any more."""
    return sorted(file.stem for file in place.glob("[!.]*.json") if file.stem not in hosts)


def recall(place: Path, host: str) -> Observed:
    """What ``host`` ran when it was last deployed from here; nothing when that is not known."""
    try:
        entry = json.loads((place / f"{host}.json").read_text("utf-8"))
        return Observed(digest=str(entry["digest"]), manifest=dict(entry["manifest"]))
    except (OSError, ValueError, KeyError, TypeError):
        return NOTHING
