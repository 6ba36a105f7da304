"""What nodes of Fast DDS that were killed have left in the shared memory."""

from __future__ import annotations

import os
import re
from contextlib import suppress

from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    (
        "what killed nodes have left takes 10 % of `/dev/shm`, or more",
        "a warning, with the command that removes it",
    ),
)
_FOLDER, _LOCKS = "/dev/shm", "/proc/locks"
_SEGMENT = re.compile(r"fast(rtps|dds)_[0-9a-f]{16}")
_LOCK = "_el"  # beside a segment: its process has it locked
_LARGE = 0.1  # of the shared memory


class Seen(NamedTuple):
    """How many segments no process has locked, their size, and that of the whole shared memory, bytes."""

    segments: int
    size: int
    whole: int


def observe(home: Home, folder: str = _FOLDER, locks: str = _LOCKS) -> list[Seen]:
    """Nothing where no such segment is. Raises ``OSError`` where there is no such folder.

    The kernel's list of locks is read, as a lock that is tried would keep a starting node from it.
    """
    names = [one for one in os.listdir(folder) if _SEGMENT.fullmatch(one)]
    with open(locks, encoding="ascii") as file:
        locked = {fields[5] for fields in (line.split() for line in file) if fields[1] == "FLOCK"}
    left = []
    for name in names:
        with suppress(OSError):  # it has just been removed
            if not _is_locked(f"{folder}/{name}{_LOCK}", locked):
                left.append(os.stat(f"{folder}/{name}").st_blocks * 512)
    if not left:
        return []
    whole = os.statvfs(folder)
    return [Seen(len(left), sum(left), whole.f_blocks * whole.f_frsize)]


def _is_locked(path: str, locked: set[str]) -> bool:
    try:
        status = os.stat(path)
    except FileNotFoundError:
        return False
    place = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"  # proc_locks(5)
    return place in locked


def judge(seen: Seen, host: str) -> Judged:
    """Warns before nodes find no memory to start."""
    many = "1 segment" if seen.segments == 1 else f"{seen.segments} segments"
    text = f"{many} of nodes that were killed, {seen.size / (1 << 20):.1f} MiB of {seen.whole >> 20}"
    if seen.size < _LARGE * seen.whole:
        return Judged("ok", text)
    return Judged("warning", text, f"on {host}: fastdds shm clean")
