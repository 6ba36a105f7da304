"""The file systems to which a swarm writes: space, inodes, and whether they can be written."""

from __future__ import annotations

import os

from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.paths import ROOT
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterable

    from swarm_onboard.agent.release_store import Home

TABLE = (
    ("`/opt/swarm`, `/etc`, `/run`, `/var/log` or `/tmp` is full, without inodes, or read-only", "unhealthy"),
    ("less than 5 % and 200 MiB of one are free, or less than 1 000 inodes", "a warning"),
)
_PLACES = (ROOT, "/etc", "/run", "/var/log", "/tmp")
_FULL, _FULL_INODES = 4 << 20, 64  # bytes; the agent wants a little more than 1 MiB for a release
_SCARCE, _SCARCE_SHARE = 200 << 20, 0.05  # bytes; of the size: both are warned of
_SCARCE_INODES = 1000


class Seen(NamedTuple):
    """A file system as it is mounted at ``place``; ``used_by``: one of the swarm's folders on it.

    ``free`` and ``size`` in bytes; ``inodes`` that are free, None where they have no number.
    """

    place: str
    used_by: str
    free: int
    size: int
    inodes: int | None
    read_only: bool


def observe(home: Home) -> list[Seen]:
    """Returns each file system once (statvfs(3))."""
    with open("/proc/self/mounts", encoding="utf-8", errors="replace") as file:
        mounts = [line.split(" ")[1] for line in file]
    found: dict[str, Seen] = {}
    for used_by in _PLACES:
        path = os.path.realpath(home.outside(used_by))
        if not os.path.isdir(path):
            continue
        place, space = _mounted(path, mounts), os.statvfs(path)
        if place not in found:
            found[place] = Seen(
                place,
                used_by,
                free=space.f_bavail * space.f_frsize,
                size=space.f_blocks * space.f_frsize,
                inodes=space.f_favail if space.f_files else None,
                read_only=bool(space.f_flag & os.ST_RDONLY),
            )
    return list(found.values())


def _mounted(path: str, mounts: Iterable[str]) -> str:
    """The mount point of ``path``; a bind mount is one, too."""
    return max((one for one in mounts if f"{path}/".startswith(f"{one.rstrip('/')}/")), key=len, default="/")


def judge(seen: Seen, host: str) -> Judged:
    """Names a file system that cannot be written, and one that soon cannot."""
    if seen.read_only:
        text = f"is read-only: no deploy, and no stop that outlives a restart; {seen.used_by} is on it"
        hint = f"on {host}: sudo dmesg | tail -50; if the disk is sound: sudo mount -o remount,rw"
        return Judged("bad", text, f"{hint} {seen.place}", seen.place)
    largest = f"on {host}: sudo du -xh {seen.place} | sort -h | tail -20"
    if seen.free < _FULL:
        text = f"is full: {seen.free >> 10} KiB free; {seen.used_by} is on it"
        return Judged("bad", text, largest, seen.place)
    if seen.inodes is not None and seen.inodes < _FULL_INODES:
        text = f"has {seen.inodes} inodes left: no file can be made; {seen.used_by} is on it"
        hint = f"on {host}: sudo du -x --inodes {seen.place} | sort -n | tail -20"
        return Judged("bad", text, hint, seen.place)
    if seen.free < min(_SCARCE, _SCARCE_SHARE * seen.size):
        text = f"is almost full: {seen.free >> 20} MiB free of {seen.size >> 20} MiB"
        return Judged("warning", text, largest, seen.place)
    if seen.inodes is not None and seen.inodes < _SCARCE_INODES:
        return Judged("warning", f"has only {seen.inodes} inodes left", largest, seen.place)
    return Judged("ok", f"{seen.free >> 20} MiB free", "", seen.place)
