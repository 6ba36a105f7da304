"""The subnet of each wlan and ethernet: as declared, or inferred from the addresses of its hosts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from swarmctl.links.link_base import NetworkLink
from swarmctl.spec.model import Spec
from swarmctl.swarm import wireguard_addresses
from swarmctl.swarm.addresses import Ip, Subnet, ip_of, subnet_of, usual_subnets


def addresses_of(spec: Spec) -> Mapping[str, Ip | None]:
    """Returns the IP address of every host; None for a host whose `address` is a name."""
    return {name: ip_of(host.address) for name, host in spec.hosts.items()}


def advertised(spec: Spec, host: str) -> str:
    """What identifies ``host`` in the URIs of its nodes and its master.

    fkie and drivers compare it character by character, so all generated files take it from here.
    """
    return host if spec.ros.naming == "hosts" else ros_address(spec, host)


def ros_address(spec: Spec, host: str) -> str:
    """Returns the address that ROS uses on ``host``: in a sealed swarm that of its WireGuard."""
    own = spec.hosts[host].address
    return str(wireguard_addresses.address_of(spec, host)) if spec.has_wireguard else own


def subnet_sources_of(
    networks: Sequence[tuple[int, NetworkLink]], addresses: Mapping[str, Ip | None]
) -> Mapping[int, tuple[str, ...]]:
    """By network index, the hosts whose address must be in its subnet, since they are on no other network.

    If every host with an IP address is on several networks, all of them are returned.
    """
    count = Counter(host for _, link in networks for host in set(link.hosts))
    found = {}
    for index, link in networks:
        known = tuple(host for host in dict.fromkeys(link.hosts) if addresses.get(host) is not None)
        found[index] = tuple(host for host in known if count[host] == 1) or known
    return found


def subnets_of(
    networks: Mapping[int, NetworkLink],
    addresses: Mapping[str, Ip | None],
    sources: Mapping[int, tuple[str, ...]],
) -> Mapping[int, Subnet | None]:
    """Returns the subnet of every network, by its index; None if the addresses of its hosts differ."""
    found: dict[int, Subnet | None] = {}
    for index, link in networks.items():
        if link.subnet is not None:
            found[index] = subnet_of(link.subnet)
        else:
            seen = usual_subnets(ip for host in sources[index] if (ip := addresses[host]) is not None)
            found[index] = seen[0] if len(seen) == 1 else None
    return found
