"""``wireguard_key``: the public WireGuard key of the host, and its change to the next one."""

from __future__ import annotations

from swarm_onboard.agent import files, known_keys, wireguard_key
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.messages import WireguardKeyAnswer, WireguardKeyRequest


def handle(request: WireguardKeyRequest, payload: bytes, report: Report) -> WireguardKeyAnswer:
    """Returns the keys. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request["swarm"])
    known_keys.learn(home, str(request.get("known", "")))
    if request.get("expel"):
        wireguard_key.expel(home, str(request["expel"]))
    if request.get("use"):
        wireguard_key.change_to(home, str(request["use"]))
    following = wireguard_key.next_public(home, make=bool(request.get("make_next")))
    public = wireguard_key.public(home)
    files.sync(known_keys.folder(home))  # what an agent that was killed has made, too
    return {"public": public, "next": following}
