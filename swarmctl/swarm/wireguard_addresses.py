"""The addresses of a sealed swarm: one of each host, in a network that only its WireGuard carries. Pure."""

from __future__ import annotations

import zlib
from ipaddress import IPv4Address, IPv4Network

from swarmctl.spec.model import Spec


def network_of(spec: Spec) -> IPv4Network:
    """Returns the network of the swarm's WireGuard: `overlay`, by default one that follows from its name."""
    if spec.overlay is not None:
        return IPv4Network(spec.overlay)
    return IPv4Network(f"10.{128 + zlib.crc32(spec.name.encode()) % 127}.0.0/16")


def address_of(spec: Spec, host: str) -> IPv4Address:
    """Returns the address of ``host`` there. It follows from both names, so no other host changes it."""
    network = network_of(spec)
    number = zlib.crc32(f"{network} {host}".encode()) % (network.num_addresses - 2)
    return network[number + 1]
