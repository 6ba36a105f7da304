"""Which addresses each wlan and ethernet has: as declared, or as the hosts that are only there show."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from swarmctl.spec.model import NetworkLink, Spec
from swarmctl.topology.address import Ip, Subnet, ip_of, subnet_of, usual_subnets


def addresses_of(spec: Spec) -> Mapping[str, Ip | None]:
    """The IP address of every host; nothing for one that is called by a name."""
    return {name: ip_of(host.address) for name, host in spec.hosts.items()}


def advertised(spec: Spec, host: str) -> str:
    """What stands for ``host`` in the URIs of its nodes and its master.

    fkie and drivers compare it letter by letter, so all that is generated takes it from here.
    """
    return host if spec.ros.naming == "hosts" else spec.hosts[host].address


def witnesses_of(spec: Spec, addresses: Mapping[str, Ip | None]) -> Mapping[int, tuple[str, ...]]:
    """By index in ``links``: the hosts whose address must be the network's, since they are on no other.

    Where every host of a network is on another one too, any of them may tell.
    """
    networks = [(index, link) for index, link in enumerate(spec.links) if isinstance(link, NetworkLink)]
    count = Counter(host for _, link in networks for host in set(link.hosts))
    found = {}
    for index, link in networks:
        known = tuple(host for host in dict.fromkeys(link.hosts) if addresses.get(host) is not None)
        found[index] = tuple(host for host in known if count[host] == 1) or known
    return found


def subnets_of(
    spec: Spec, addresses: Mapping[str, Ip | None], witnesses: Mapping[int, tuple[str, ...]]
) -> Mapping[int, Subnet | None]:
    """By index in ``links``: the subnet of every network; nothing where its hosts do not agree on one."""
    found: dict[int, Subnet | None] = {}
    for index, hosts in witnesses.items():
        link = spec.links[index]
        if isinstance(link, NetworkLink) and link.subnet is not None:
            found[index] = subnet_of(link.subnet)
        else:
            seen = usual_subnets(ip for host in hosts if (ip := addresses[host]) is not None)
            found[index] = seen[0] if len(seen) == 1 else None
    return found
