"""The firewall of a host of a filtered island: the kernel must have the table that its unit loaded."""

from __future__ import annotations

from swarm_onboard.agent import command, files
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    (
        "the table of nftables that its release has is not loaded, or was changed since",
        "unhealthy: others reach its ROS",
    ),
)


class Seen(NamedTuple):
    """Whether the kernel has the swarm's table, and whether that is what was loaded."""

    table: str
    loaded: bool
    same: bool


def observe(home: Home) -> list[Seen]:
    """Compares what nft lists with what it listed when the unit had loaded it; nothing without a firewall."""
    if files.read(f"{home.current_link}/firewall.nft") is None:
        return []
    table = f"swarm-{home.swarm}"
    listed = command.output_of(["nft", "-s", "list", "table", "inet", table])
    before = files.read(home.outside(f"/run/{table}.firewall/table")) or b""
    return [Seen(table, bool(listed), listed.encode() == before)]


def judge(seen: Seen, host: str) -> Judged:
    """Names a firewall that does not act as the release has it."""
    hint = f"on {host}: sudo systemctl restart {seen.table}.firewall; other rules may flush it"
    if not seen.loaded:
        return Judged("bad", f"table {seen.table} of nftables is not loaded: its ROS is open to all", hint)
    if not seen.same:
        return Judged("bad", f"table {seen.table} of nftables was changed since it was loaded", hint)
    return Judged("ok", f"table {seen.table} of nftables is loaded")
