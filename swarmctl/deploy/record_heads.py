"""Stores the heads of the records of commands that this operator has read: they must be there later, too."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from swarm_onboard.common.record_chain import Head


def path_of(place: Path, host: str) -> Path:
    """Returns the file with the heads of a host, in the journal of its swarm."""
    return place / f".commands-{host}.json"


def recall(place: Path, host: str) -> dict[str, Head]:
    """Returns the heads by robot; none if they are not known."""
    try:
        found = json.loads(path_of(place, host).read_text("utf-8"))
        return {str(robot): Head(int(one["number"]), str(one["digest"])) for robot, one in found.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def remember(place: Path, host: str, heads: Mapping[str, Head]) -> None:
    """Stores the heads by robot, atomically. Raises ``OSError``."""
    place.mkdir(parents=True, exist_ok=True)
    draft = place / f".commands-{host}.new"
    draft.write_text(json.dumps({robot: asdict(head) for robot, head in heads.items()}), "utf-8")
    draft.replace(path_of(place, host))
