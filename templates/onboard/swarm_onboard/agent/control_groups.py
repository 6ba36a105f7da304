"""The control groups of a swarm's units; systemd removes that of a unit that has ended (cgroups(7))."""

from __future__ import annotations

import os
from contextlib import suppress

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator

#: Where systemd has the units of a host, with control groups of version 2 and of version 1.
SLICES = ("/sys/fs/cgroup/system.slice", "/sys/fs/cgroup/systemd/system.slice")


def of_swarm(swarm: str) -> dict[str, str]:
    """Returns the folder of each unit of the swarm that runs, by the unit's name."""
    found: dict[str, str] = {}
    for slices in SLICES:
        with suppress(OSError):
            names = (name for name in os.listdir(slices) if name.startswith(f"swarm-{swarm}."))
            found.update((name, f"{slices}/{name}") for name in names)
    return dict(sorted(found.items()))


def processes(folder: str) -> Iterator[int]:
    """Yields the processes of a unit, and of the groups that it has made below its own."""
    for below, _, files in os.walk(folder):
        if "cgroup.procs" in files:
            with suppress(OSError), open(f"{below}/cgroup.procs", encoding="ascii") as file:
                yield from map(int, file.read().split())
