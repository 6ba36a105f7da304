"""``wireguard_key``: the public WireGuard key of the host, which makes its private one if it has none."""

from __future__ import annotations

from swarm_onboard.agent import wireguard_key
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.messages import WireguardKeyAnswer, WireguardKeyRequest


def handle(request: WireguardKeyRequest, payload: bytes, report: Report) -> WireguardKeyAnswer:
    """Returns the public key."""
    return {"public": wireguard_key.public(home_of(request["swarm"]))}
