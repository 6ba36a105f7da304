"""The WireGuard of a host: with each peer that runs there must be a handshake every 3 minutes."""

from __future__ import annotations

import re
import time

from swarm_onboard.agent import command, files
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged
from swarm_onboard.tunnel.interface import FRESH

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    (
        "a host of a sealed swarm had no handshake with a peer for 3 minutes, and the peer answers `status`",
        "unhealthy: nothing of ROS passes between the two; below the clock of one that is behind",
    ),
)
_PEER = re.compile(rb"# ([a-z0-9-]+)\n\[Peer\]\nPublicKey = (\S+)\n")


class Seen(NamedTuple):
    """A peer, and how long ago its last handshake was, s; negative if there was none."""

    peer: str
    age: float


def observe(home: Home) -> list[Seen]:
    """Returns the peers of the release that the interface has; none while it is down."""
    text = files.read(f"{home.current_link}/wireguard/peers.conf") or b""
    lines = command.output_of(["wg", "show", "all", "latest-handshakes"]).splitlines() if text else []
    times = {key: int(last) for _, key, last in (line.split("\t") for line in lines)}
    peers = [(name.decode(), key.decode()) for name, key in _PEER.findall(text)]
    now = time.time()
    return [Seen(name, now - times[key] if times[key] else -1.0) for name, key in peers if key in times]


def judge(seen: Seen, host: str) -> Judged:
    """Names a peer with which no packet can pass."""
    peer = seen.peer
    if 0 <= seen.age <= FRESH:
        return Judged("ok", f"a handshake with {peer} {seen.age:.0f} s ago", about=peer, peer=peer)
    ever = "for 3 minutes" if seen.age > 0 else "since it started"
    hint = (
        f"between {host} and {peer} UDP port 51820 must pass, the clocks of both must be right, and "
        "`swarmctl trust` must know their keys"
    )
    return Judged("bad", f"no handshake with {peer} {ever}", hint, about=peer, peer=peer)
