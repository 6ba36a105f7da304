"""Addresses of hosts and subnets of networks: from the spec, inferred, and those of WireGuard."""

from __future__ import annotations

import ipaddress
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from ipaddress import IPv4Address, IPv4Network

from swarmctl.links.ip_link import IpLink
from swarmctl.links.link_base import NetworkLink
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.model import Spec

Ip = ipaddress.IPv4Address | ipaddress.IPv6Address
OWN_NAME = "127.0.1.1"  # that of a host's own name on Debian (Debian Reference, 5.1.1)
Subnet = ipaddress.IPv4Network | ipaddress.IPv6Network


class Kind(str, Enum):
    """The use of an IP address (IANA special-purpose registry, RFC 6890). Values end an error message."""

    ORDINARY = "a host address"
    IPV6 = "a literal IPv6 address, which ROS 1 nodes cannot advertise"
    UNSPECIFIED = "an unspecified address"
    LOOPBACK = "a loopback address"
    LINK_LOCAL = "a link-local address, as a host without DHCP has"
    GROUP = "a multicast address"
    RESERVED = "reserved, or the broadcast address"


class Scheme(str, Enum):
    """How other hosts resolve a host's `address`."""

    IP = "an IP address"
    MDNS = "a `.local` name"
    NAME = "a name"


@lru_cache(maxsize=1 << 14)  # rules ask again for the hosts of a spec
def ip_of(address: str) -> Ip | None:
    """Returns the IP address, or None for a name."""
    try:
        return ipaddress.ip_address(address)
    except ValueError:
        return None


def is_ipv6(address: str) -> bool:
    """True of an IPv6 address; of no name, whatever it resolves to."""
    ip = ip_of(address)
    return ip is not None and ip.version == 6


def bracketed(address: str) -> str:
    """Returns an address as it stands before a port."""
    return f"[{address}]" if is_ipv6(address) else address


def normal(address: str) -> str:
    """Returns the canonical spelling of an address, to compare addresses by."""
    return str(ip_of(address) or address.lower().rstrip("."))


def kind(ip: Ip) -> Kind:
    """Returns the use of an IP address."""
    if ip.version == 6:
        return Kind.IPV6
    first = int(ip) >> 24
    if first == 0:
        return Kind.UNSPECIFIED
    if first == 127:
        return Kind.LOOPBACK
    if int(ip) >> 16 == 0xA9FE:
        return Kind.LINK_LOCAL
    if first >= 224:
        return Kind.GROUP if first < 240 else Kind.RESERVED
    return Kind.ORDINARY


def means_self(address: str) -> bool:
    """True if ``address`` means the local computer on every computer."""
    ip = ip_of(address)
    if ip is None:
        return normal(address) in ("localhost", "localhost.localdomain")
    return ip.is_loopback


def scheme(address: str) -> Scheme:
    """Returns how other hosts resolve ``address``."""
    if ip_of(address) is not None:
        return Scheme.IP
    return Scheme.MDNS if normal(address).endswith(".local") else Scheme.NAME


def subnet_of(text: str) -> Subnet:
    """Returns the subnet of a valid text such as ``10.0.0.0/24``."""
    return ipaddress.ip_network(text)


def usual_subnet(ip: Ip) -> Subnet:
    """Returns the /24 (or /64) around an address: what a lab's router uses by default."""
    return ipaddress.ip_network((ip, 24 if ip.version == 4 else 64), strict=False)


def usual_subnets(ips: Iterable[Ip]) -> tuple[Subnet, ...]:
    """Returns the /24s (or /64s) of ``ips``, each once, in the order of ``ips``."""
    found = {(int(ip) >> (8 if ip.version == 4 else 64), ip.version): ip for ip in ips}
    return tuple(usual_subnet(ip) for ip in found.values())


def smallest_subnet(ips: Iterable[Ip]) -> Subnet:
    """Returns the smallest subnet that has all ``ips`` (of one IP version) as addresses of hosts."""
    first, *others = ips
    found = ipaddress.ip_network((first, first.max_prefixlen - 2), strict=False)
    for ip in (first, *others):
        while ip not in found or ip in (found.network_address, found.broadcast_address):
            found = found.supernet()
    return found


@dataclass(frozen=True)
class IpEnds:
    """A udp or tcp link: the robot's ``port``, the ports of its host, what both exchange, and their network.

    ``port`` and ``load_mbps`` are None if neither the link nor the robot type has them; ``network`` is None
    if the robot's address lies in no network of the host.
    """

    link: IpLink
    port: int | None
    local_ports: tuple[int, ...]
    load_mbps: float | None
    network: NetworkLink | None


def ends_of(
    link: IpLink, kind: AnyRobotType | None, networks: Iterable[tuple[NetworkLink, Subnet | None]]
) -> IpEnds:
    """Returns both ends of a link to a robot of type ``kind``; ``networks`` are those of its host."""
    usual = kind.link if isinstance(kind, RosRobotType) else None
    ip = ip_of(link.address)
    inside = (
        network for network, subnet in networks if ip is not None and subnet is not None and ip in subnet
    )
    local = link.local_ports
    return IpEnds(
        link,
        link.port or (usual.port if usual is not None else None),
        local if local is not None else usual.local_ports if usual is not None else (),
        usual.load_mbps if usual is not None else None,
        next(inside, None),
    )


def wireguard_network(spec: Spec) -> IPv4Network:
    """Returns the network of the swarm's WireGuard: `overlay`, by default one that follows from its name."""
    if spec.overlay is not None:
        return IPv4Network(spec.overlay)
    return IPv4Network(f"10.{128 + zlib.crc32(spec.name.encode()) % 127}.0.0/16")


def wireguard_address(spec: Spec, host: str) -> IPv4Address:
    """Returns the address of ``host`` there. It follows from both names, so no other host changes it."""
    network = wireguard_network(spec)
    number = zlib.crc32(f"{network} {host}".encode()) % (network.num_addresses - 2)
    return network[number + 1]


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
    return str(wireguard_address(spec, host)) if spec.has_wireguard else own


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
