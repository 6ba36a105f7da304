"""The peers of a host in the format of `wg setconf`, from those of its release and the known keys. Pure."""

from __future__ import annotations

from typing import AbstractSet, Any, Mapping

from swarm_onboard.tunnel.keys import Keys

PEERS = "wireguard/peers.json"  # in a release


def chosen(keys: Keys, peers: Mapping[str, Any], met: AbstractSet[str]) -> Mapping[str, str]:
    """Returns the key of each peer whose packets count.

    Of several it is the last with which there was a handshake, so that a host changes its key when it likes;
    without any, the first. Peers without a key are left out.
    """
    found = {one["name"]: keys.live.get(one["name"], ()) for one in peers["peers"]}
    return {
        name: next((one for one in reversed(own) if one in met), own[0]) for name, own in found.items() if own
    }


def config(keys: Keys, peers: Mapping[str, Any], met: AbstractSet[str]) -> str:
    """Returns what `wg setconf` and `wg syncconf` read, without the private key.

    Each key of a peer is called, and the chosen one has its addresses: cryptokey routing of WireGuard.
    """
    counts = chosen(keys, peers, met)
    text = f"[Interface]\nListenPort = {peers['port']}\n"
    for one in peers["peers"]:
        for key in keys.live.get(one["name"], ()):
            text += f"\n# {one['name']}\n[Peer]\nPublicKey = {key}\n"
            if key == counts[one["name"]]:
                text += "AllowedIPs = {}\n".format(", ".join(f"{at}/32" for at in one["addresses"]))
            text += f"Endpoint = {one['endpoint']}:{peers['port']}\nPersistentKeepalive = 25\n"
    return text
