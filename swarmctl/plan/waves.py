"""The order of a rollout: a canary on which little depends, then a quarter of the hosts, then the rest."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from swarmctl.analysis.impact import Impact
from swarmctl.plan.plan import HostPlan

Consistency = Literal["independent", "wave", "all"]
_STEP = re.compile(r"(?P<number>[0-9]+)(?P<percent>%?)")


@dataclass(frozen=True)
class Order:
    """Hosts in ``waves``; those of a wave change at a time, and the next one follows if few failed.

    ``independent``: each host stays changed or rolls back automatically; ``wave``: the hosts of a wave stay
    changed together or go back together; ``all``: there is one wave.
    """

    waves: tuple[tuple[str, ...], ...]
    consistency: Consistency

    @property
    def together(self) -> bool:
        """True if the hosts of a wave are confirmed only once all of them could be."""
        return self.consistency != "independent"

    def to_json(self) -> dict[str, Any]:
        """Returns the order in ``deploy --dry-run --json``."""
        return {"waves": [list(wave) for wave in self.waves], "consistency": self.consistency}


def order(
    due: Sequence[HostPlan],
    parts: Iterable[Impact],
    serial: Sequence[str] = (),
    consistency: Consistency | None = None,
    shared_files: Collection[str] = (),
) -> Order:
    """Returns the order in which the plans are executed. ``parts``: what is lost with each part of the swarm.

    ``serial``: sizes of the waves in hosts or percent, the last one repeated; ``consistency``: chosen here if
    it is None, ``all`` where one of ``shared_files`` changes, on which all hosts must agree.
    """
    chosen = consistency or ("all" if any(_changes(plan, shared_files) for plan in due) else "independent")
    weight = {one.name: one.weight for one in parts if one.kind == "host"}
    hosts = sorted((plan.host for plan in due), key=lambda host: weight.get(host, ()))
    first = all(plan.previous is None for plan in due)
    if chosen == "all" or (first and not serial):
        return Order((tuple(hosts),) if hosts else (), chosen)
    return Order(tuple(_cut(hosts, _sizes(serial, len(hosts)))), chosen)


def valid_size(text: str) -> bool:
    """Returns True for a number of hosts above 0, or a percentage of 1 to 100."""
    found = _STEP.fullmatch(text)
    return found is not None and 0 < int(found["number"]) <= (100 if found["percent"] else 10**6)


def _changes(plan: HostPlan, files: Collection[str]) -> bool:
    return plan.previous is not None and any(step.target in files for step in plan.steps)


def _sizes(serial: Sequence[str], count: int) -> list[int]:
    if not serial:
        return [1, math.ceil(count / 4) if count > 4 else count, count]
    found = []
    for text in serial:
        number = int(text.rstrip("%"))
        found.append(max(1, number * count // 100) if text.endswith("%") else number)
    return found


def _cut(hosts: Sequence[str], sizes: Sequence[int]) -> Iterable[tuple[str, ...]]:
    at = wave = 0
    while at < len(hosts):
        size = sizes[min(wave, len(sizes) - 1)]
        yield tuple(hosts[at : at + size])
        at, wave = at + size, wave + 1
