"""The memory that programs can still have."""

from __future__ import annotations

from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (("less than 5 % of the memory is available", "a warning"),)
_SCARCE = 0.05  # of the size


class Seen(NamedTuple):
    """The host's memory in bytes."""

    size: int
    available: int


def observe(home: Home) -> list[Seen]:
    """Reads proc_meminfo(5). Raises ``OSError``, ``LookupError``, ``ValueError``."""
    with open("/proc/meminfo", encoding="ascii") as file:
        lines = dict(line.split(":", 1) for line in file if ":" in line)
    return [Seen(*(int(lines[name].split()[0]) * 1024 for name in ("MemTotal", "MemAvailable")))]


def judge(seen: Seen, host: str) -> Judged:
    """Warns before the kernel ends processes for want of memory."""
    text = f"{seen.available >> 20} MiB available of {seen.size >> 20} MiB"
    if seen.available < _SCARCE * seen.size:
        return Judged("warning", f"is almost used up: {text}", f"on {host}: ps aux --sort -rss | head")
    return Judged("ok", text)
