"""Microcontroller boards that speak rosserial, and what its client library on them can hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import yaml

from swarmctl import resources


@dataclass(frozen=True)
class Board:
    """Places for publishers and subscribers, and the two buffers in bytes."""

    title: str
    publishers: int
    subscribers: int
    receives: int
    sends: int


@cache
def boards() -> Mapping[str, Board]:
    """Returns every known board by name (templates/data/boards.yaml)."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    data = yaml.load((resources.templates() / "data/boards.yaml").read_text("utf-8"), loader)
    return {name: Board(**fields) for name, fields in data.items()}
