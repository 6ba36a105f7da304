"""The addresses of a lab: those of the spec, and free ones for hosts that the spec knows by a name (mDNS)."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable, Iterator, Mapping, Sequence

from swarmctl.lab.errors import LabError
from swarmctl.swarm.addresses import Ip, Subnet, ip_of, subnet_of, usual_subnet
from swarmctl.swarm.resolved import Network, Swarm

OPERATOR = "operator"
UPLINK = "uplink"
_NAMED = "10.88.{}.0/24"  # subnets of networks on which every host is known by a name
_NAMED_IPV6 = "fd00:88:{}::/64"


def addresses_of(swarm: Swarm) -> Mapping[str, Ip]:
    """Returns the address of every host: as in the spec, else a free one of its first network."""
    known = {host.name: ip_of(host.address) for host in swarm.hosts.values()}
    found = {name: ip for name, ip in known.items() if ip is not None}
    made = 0
    for name in (name for name, ip in known.items() if ip is None):
        network = next((one for one in swarm.networks if name in one.hosts), None)
        near = [found[host] for host in network.hosts if host in found] if network else []
        if network and network.subnet:
            subnet = subnet_of(network.subnet)
        elif near:
            subnet = usual_subnet(near[0])
        else:
            subnet = subnet_of((_NAMED_IPV6 if swarm.ipv6 else _NAMED).format(made))
            made += 1
        found[name] = next(free(subnet, found.values()))
    return {name: found[name] for name in known}


def networks_of(swarm: Swarm, addresses: Mapping[str, Ip]) -> Iterator[Network]:
    """Yields the swarm's networks, and one per subnet for hosts without a network, so that swarmctl reaches
    them.
    """
    yield from swarm.networks
    linked = {host for network in swarm.networks for host in network.hosts}
    alone: dict[Subnet, list[str]] = {}
    for host, ip in addresses.items():
        if host not in linked:
            alone.setdefault(usual_subnet(ip), []).append(host)
    for number, (subnet, hosts) in enumerate(alone.items()):
        yield Network(f"{UPLINK}{number or ''}", "ethernet", tuple(hosts), str(subnet), None)


def subnet_on(network: Network, addresses: Mapping[str, Ip]) -> Subnet:
    """Returns the subnet of a network: as declared, else the one /24 that its hosts are in.

    Raises ``LabError`` if its hosts are in several.
    """
    if network.subnet is not None:
        return subnet_of(network.subnet)
    usual = {usual_subnet(addresses[host]) for host in network.hosts}
    if len(usual) == 1:
        return usual.pop()
    found = ", ".join(f"{host} {addresses[host]}" for host in network.hosts)
    raise LabError(
        f"the hosts of network {network.name} are in several subnets: {found}", "set the `subnet` of the link"
    )


def free(subnet: Subnet, taken: Iterable[Ip]) -> Iterator[Ip]:
    """Yields the unused addresses of ``subnet``, highest first: people number hosts from the lowest."""
    used = set(taken)
    last = int(subnet.broadcast_address) - 1
    for value in range(last, int(subnet.network_address), -1):
        address = type(subnet.network_address)(value)
        if address not in used:
            yield address
    raise LabError(
        f"the subnet {subnet} has no free address for swarmctl", "use a larger subnet for the link"
    )


def with_prefix(address: Ip, subnet: Subnet) -> str:
    """Returns an address as an interface has it: 10.0.0.1/24."""
    return f"{address}/{subnet.prefixlen}"


def check_names(hosts: Iterable[str]) -> None:
    """Raises ``LabError`` for a host that is called like the lab's own namespace."""
    if OPERATOR in hosts:
        raise LabError(
            f"`{OPERATOR}` is the lab's name for this machine and cannot be a host", "rename the host"
        )


def check_unique(addresses: Mapping[str, Ip]) -> None:
    """Raises ``LabError`` for two hosts with one address."""
    holders: dict[Ip, str] = {}
    for host, address in addresses.items():
        if (first := holders.setdefault(address, host)) != host:
            raise LabError(
                f"hosts {first} and {host} both have the address {address}", "give each host its own address"
            )


def check_overlaps(networks: Sequence[Network], subnets: Sequence[Subnet]) -> None:
    """Raises ``LabError`` for networks whose subnets overlap."""
    for index, (network, subnet) in enumerate(zip(networks, subnets, strict=True)):
        for other, another in zip(networks[:index], subnets[:index], strict=True):
            if subnet.version == another.version and subnet.overlaps(another):
                raise LabError(
                    f"networks {other.name} ({another}) and {network.name} ({subnet}) overlap, "
                    "so routes would be ambiguous",
                    "use a separate `subnet` for each link",
                )


def check_subnets(addresses: Mapping[str, Ip], interfaces: Mapping[str, Sequence[str]]) -> None:
    """Raises ``LabError`` for a host whose address is on none of its ``interfaces`` (with prefix length)."""
    for host, address in addresses.items():
        if not any(ipaddress.ip_interface(one).ip == address for one in interfaces[host]):
            raise LabError(
                f"host {host} has the address {address}, which is in none of its networks",
                "correct the address or the `subnet` of its links",
            )
