"""The WireGuard of a host: with each peer that runs there must be a handshake every 3 minutes."""

from __future__ import annotations

import time

from swarm_onboard.agent import command, files, json_text, known_keys
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged
from swarm_onboard.tunnel.interface import FRESH
from swarm_onboard.tunnel.keys import Keys
from swarm_onboard.tunnel.peers import PEERS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    (
        "a host of a sealed swarm had no handshake with a peer for 3 minutes, and the peer answers `status`",
        "unhealthy: nothing of ROS passes between the two; below the clock of one that is behind",
    ),
    ("a host has a live key of a peer that was expelled", "unhealthy: it accepts what that one sends"),
)


class Seen(NamedTuple):
    """A peer, and how long ago its last handshake was, s; negative if there was none."""

    peer: str
    age: float


def observe(home: Home) -> list[Seen]:
    """Returns the peers of the release that the interface has; none while it is down."""
    text = files.read(f"{home.current_link}/{PEERS}")
    if text is None:
        return []
    lines = command.output_of(["wg", "show", "all", "latest-handshakes"]).splitlines()
    times = {key: int(last) for _, key, last in (line.split("\t") for line in lines)}
    live, now = Keys(known_keys.known(home)).live, time.time()
    found = []
    for peer in json_text.loads(text.decode("utf-8"))["peers"]:
        own = [times[key] for key in live.get(peer["name"], ()) if key in times]
        if own:
            found.append(Seen(peer["name"], now - max(own) if max(own) else -1.0))
    return found


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
