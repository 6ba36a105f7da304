"""The defects that are accepted to pass, each kind with its reason, from `accepted.yaml`."""

from __future__ import annotations

from enum import Enum
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from tests.mutations.defects import Defect

LIST = Path(__file__).parent / "accepted.yaml"


class Accepted(Enum):
    """What may happen to a defect."""

    PASSES = "passes"
    ELSEWHERE = "found elsewhere"
    OTHER_SWARM = "fixed to another swarm"


@cache
def entries() -> dict[str, list[dict[str, Any]]]:
    """Returns the entries of the list: `mistake`, `reason`, and `at` (places) or `in` (names of bases)."""
    found: dict[str, list[dict[str, Any]]] = yaml.safe_load(LIST.read_text("utf-8"))
    return found


def accepted(what: Accepted, defect: Defect) -> bool:
    """Returns True if the list has a reason for ``what`` happening to ``defect``."""
    return any(_fits(entry, defect) for entry in entries()[what.value])


def _fits(entry: dict[str, Any], defect: Defect) -> bool:
    return (
        fnmatch(defect.mistake, entry["mistake"])
        and any(fnmatch(defect.change.what, place) for place in entry.get("at", ["*"]))
        and any(fnmatch(defect.base.name, name) for name in entry.get("in", ["*"]))
    )
