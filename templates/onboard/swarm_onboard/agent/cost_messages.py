"""Request and answer of ``costs``. JSON objects; types only."""

from __future__ import annotations

from typing import Literal, TypedDict


class CostsRequest(TypedDict):
    """What the units of the swarm on this host take."""

    verb: Literal["costs"]
    swarm: str


class UnitCosts(TypedDict):
    """``cpu``: CPU time, of ended children too, s; ``memory``: resident, bytes; ``processes``: number."""

    cpu: float
    memory: int
    processes: int


class CostsAnswer(TypedDict):
    """The units that run, by name; ``clock``: s of the host's monotonic clock."""

    clock: float
    units: dict[str, UnitCosts]
