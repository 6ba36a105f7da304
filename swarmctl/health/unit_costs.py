"""What each robot's driver and each program costs its host, from two reports of the host. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from swarm_onboard.agent.verbs.costs import Answer, UnitCosts

from swarmctl.health.log_entries import source_of
from swarmctl.remote.transport import HostError


@dataclass(frozen=True)
class UnitCost:
    """A unit, called as in logs. ``cpu``: cores that it keeps busy; ``memory``: resident, bytes."""

    host: str
    name: str
    cpu: float
    memory: int
    processes: int


def between(host: str, swarm: str, before: Answer, after: Answer) -> list[UnitCost]:
    """The units that run now, the busiest first. One that has started meanwhile counts from its start."""
    seconds = max(after.clock - before.clock, 1e-3)
    found = (
        UnitCost(
            host,
            source_of(unit, swarm),
            round(max(0.0, now.cpu - before.units.get(unit, UnitCosts()).cpu) / seconds, 4),
            now.memory,
            now.processes,
        )
        for unit, now in after.units.items()
    )
    return sorted(found, key=lambda one: (-one.cpu, one.name))


def chosen(
    found: Mapping[str, list[UnitCost] | HostError], parts: Mapping[str, Sequence[str]]
) -> tuple[list[UnitCost], dict[str, HostError]]:
    """The units of the selected robots and programs, all of a host without any; and the hosts with errors."""
    units = [
        one
        for host, costs in found.items()
        if not isinstance(costs, HostError)
        for one in costs
        if not parts[host] or one.name.partition("/")[0] in parts[host]
    ]
    return units, {host: one for host, one in found.items() if isinstance(one, HostError)}
