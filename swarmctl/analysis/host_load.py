"""The memory that each host needs for its drivers and programs, beside the memory it has. Pure numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from swarmctl.render.middleware import middleware_of
from swarmctl.render.multimaster import running_on
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Bridge, carriers

# MB. A driver may take 60 (its bar). A Linux without a desktop takes 100 to 200, as Raspberry Pi OS Lite.
DRIVER_MB = 60
GATE_MB = 40  # its bar
SYSTEM_MB = 200
SMALL_MB = 1024  # computers with no more memory than this are slow as well: Raspberry Pi 1 to 3, Zero
SMALL_NODES = 20  # that such a computer's master should serve at most; a rule of thumb


@dataclass(frozen=True)
class HostBudget:
    """The memory of a host whose kind of computer is declared, and the nodes that its master serves."""

    host: str
    computer: str
    memory_mb: int
    parts: tuple[tuple[str, int], ...]  # what needs how many MB
    served: int  # nodes of the island whose master it runs; 0 if it runs none

    @property
    def needed_mb(self) -> int:
        """The memory that all parts need, in MB."""
        return sum(size for _, size in self.parts)

    @property
    def share(self) -> float:
        """The needed share of the memory; above 1 it does not fit."""
        return self.needed_mb / self.memory_mb

    @property
    def small(self) -> bool:
        """True if the host has little memory, like an early Raspberry Pi."""
        return self.memory_mb <= SMALL_MB

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "host": self.host,
            "computer": self.computer,
            "memory_mb": self.memory_mb,
            "needed_mb": self.needed_mb,
            "parts": dict(self.parts),
            "share": round(self.share, 3),
            "nodes_served": self.served,
        }


def host_budgets(index: SwarmIndex, bridges: Iterable[Bridge]) -> Iterator[HostBudget]:
    """Yields the budget of every host whose kind of computer is declared, in the order of the spec."""
    drivers: Counter[str | None] = Counter(index.driving.values())
    programs: dict[str, list[tuple[str, int]]] = {}
    gates = Counter(index.driving[robot] for robot in index.gated)
    nodes = drivers + gates
    for name, host in index.program_hosts.items():
        if host is not None:
            nodes[host] += 1
            programs.setdefault(host, []).append((name, index.spec.programs[name].memory_mb or 0))
    islands = index.islands
    master_mb = {one.hub: middleware_of(one.distro).master_mb for one in islands}
    served = {one.hub: sum(nodes[host] for host in one.hosts) for one in islands if master_mb[one.hub]}
    running = running_on(index.spec.multimaster, islands, carriers(islands, bridges))
    multimaster_mb = {one.hub: running[one.name].memory_mb for one in islands if one.name in running}
    for name in index.spec.hosts:
        kind = index.computer_of(name)
        if kind is None:
            continue
        parts = [
            ("system", SYSTEM_MB),
            ("master", master_mb.get(name, 0)),
            ("multimaster", multimaster_mb.get(name, 0)),
            (f"{drivers[name]} driver{'s' if drivers[name] > 1 else ''}", drivers[name] * DRIVER_MB),
            (f"{gates[name]} gate{'s' if gates[name] > 1 else ''}", gates[name] * GATE_MB),
            *programs.get(name, ()),
        ]
        needed = tuple(part for part in parts if part[1])
        yield HostBudget(name, kind, index.computers[kind].memory_mb, needed, served.get(name, 0))
