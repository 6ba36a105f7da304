"""The peers as wg reads them: each of their keys, and the address with the one that counts."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping

import pytest
from swarm_onboard.tunnel.keys import Keys, line
from swarm_onboard.tunnel.peers import chosen, config

OLD, NEXT, OTHER = (base64.b64encode(bytes([one]) * 32).decode() for one in (1, 2, 3))
PEERS = {
    "port": 51820,
    "peers": [
        {"name": "k3-pi", "addresses": ["10.9.0.2"], "endpoint": "192.168.7.2"},
        {"name": "pi-1", "addresses": ["10.9.0.3"], "endpoint": "[fd00::3]"},
    ],
}
BOTH = line("k3-pi", OLD) + line("k3-pi", NEXT) + line("pi-1", OTHER)


def routed(text: str) -> Mapping[str, str]:
    """By key, the address of a peer; empty without one."""
    return dict(re.findall(r"PublicKey = (\S+)\n(?:AllowedIPs = (\S+)\n)?Endpoint", text))


@pytest.mark.parametrize(
    ("met", "counts"), [(set(), OLD), ({OLD}, OLD), ({NEXT}, NEXT), ({OLD, NEXT, OTHER}, NEXT)]
)
def test_the_next_key_counts_once_it_was_met(met: set[str], counts: str) -> None:
    """The old one, which somebody may have stolen, never counts again."""
    keys = Keys(BOTH)
    assert chosen(keys, PEERS, met) == {"k3-pi": counts, "pi-1": OTHER}
    idle = NEXT if counts == OLD else OLD
    assert routed(config(keys, PEERS, met)) == {counts: "10.9.0.2/32", idle: "", OTHER: "10.9.0.3/32"}


def test_a_peer_without_a_live_key_is_left_out() -> None:
    keys = Keys(BOTH + line("k3-pi", OLD, retired=True) + line("k3-pi", NEXT, retired=True))
    assert config(keys, PEERS, {NEXT}) == (
        "[Interface]\nListenPort = 51820\n"
        f"\n# pi-1\n[Peer]\nPublicKey = {OTHER}\nAllowedIPs = 10.9.0.3/32\n"
        "Endpoint = [fd00::3]:51820\nPersistentKeepalive = 25\n"
    )
