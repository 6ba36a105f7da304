"""What the host has left: space and inodes of its file systems, memory, and how warm it is."""

from __future__ import annotations

import os

from . import files
from .named_tuple import NamedTuple
from .paths import ROOT

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterable

    from .probe_messages import DiskAnswer, MemoryAnswer
    from .release_store import Home

_PLACES = (ROOT, "/etc", "/run", "/var/log", "/tmp")
_THERMAL = "/sys/class/thermal"
_SHORTEST = 50  # clock ticks of 10 ms
_BOARD = ("cpu", "soc")  # how the types of zones begin on boards such as a Raspberry Pi; PCs bear more


def disks(home: Home) -> list[DiskAnswer]:
    """Returns the file systems to which a swarm writes, as they are mounted there (statvfs(3))."""
    mounts = [line.split(" ")[1] for line in _lines("/proc/self/mounts")]
    found: dict[str, DiskAnswer] = {}
    for used_by in _PLACES:
        path = os.path.realpath(home.outside(used_by))
        if not os.path.isdir(path):
            continue
        place, space = _mounted(path, mounts), os.statvfs(path)
        if place not in found:
            found[place] = {
                "place": place,
                "used_by": used_by,
                "free": space.f_bavail * space.f_frsize,
                "size": space.f_blocks * space.f_frsize,
                "inodes": space.f_favail if space.f_files else None,
                "read_only": bool(space.f_flag & os.ST_RDONLY),
            }
    return list(found.values())


def _mounted(path: str, mounts: Iterable[str]) -> str:
    """The mount point of ``path``; a bind mount is one, too."""
    return max((one for one in mounts if f"{path}/".startswith(f"{one.rstrip('/')}/")), key=len, default="/")


def _lines(path: str) -> list[str]:
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read().splitlines()


def memory() -> MemoryAnswer:
    """Returns the memory in bytes (proc_meminfo(5)). Raises ``OSError``, ``LookupError``, ``ValueError``."""
    lines = dict(line.split(":", 1) for line in _lines("/proc/meminfo") if ":" in line)
    size, available = (int(lines[name].split()[0]) * 1024 for name in ("MemTotal", "MemAvailable"))
    return {"size": size, "available": available}


class Work(NamedTuple):
    """How long the processors have worked since the boot, and that time with the time they rested."""

    busy: int
    all: int

    def share_since(self, before: Work) -> float | None:
        """Returns the share of the time since ``before`` in which they worked; None after less than 0.5 s."""
        passed = self.all - before.all
        return (self.busy - before.busy) / passed if passed >= _SHORTEST * (os.cpu_count() or 1) else None


def work() -> Work:
    """Returns what the processors have done so far, in clock ticks (proc_stat(5))."""
    ticks = [int(word) for word in _lines("/proc/stat")[0].split()[1:9]]
    idle, waiting_for_disks = ticks[3:5]
    return Work(sum(ticks) - idle - waiting_for_disks, sum(ticks))


def temperature(home: Home) -> float | None:
    """Returns the temperature of a board's processor, its warmest part, in degrees Celsius; else None."""
    folder = home.outside(_THERMAL)
    found = []
    for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else ():
        kind, value = (files.read(f"{folder}/{name}/{part}") or b"" for part in ("type", "temp"))
        if kind.decode("ascii", "replace").lower().startswith(_BOARD) and value.strip().isdigit():
            found.append(int(value) / 1000)
    return max(found, default=None)
