"""Host addresses: an IP address, or a name that only the hosts themselves can resolve."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable
from enum import Enum
from functools import lru_cache

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
