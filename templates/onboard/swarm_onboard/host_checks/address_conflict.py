"""Another machine with the address of a host: it answers an ARP probe, which changes nothing (RFC 5227)."""

from __future__ import annotations

import re
import socket
import time

from swarm_onboard.agent import command
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged, address

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    ("another machine answers for the address that its nodes advertise", "unhealthy, with its MAC address"),
)
_ARP = 0x0806  # linux/if_ether.h
_PROBE = bytes.fromhex("0001 0800 06 04 0001")  # Ethernet, IPv4, their lengths, a request
_LINK = re.compile(r"\d+: ([^:@]+)[:@].*?<([^>]*)>.* link/ether ([0-9a-f:]{17}) ")
_AWAITED = 0.25  # s, more than Wi-Fi that saves power takes to answer
_MOST = 5


class Seen(NamedTuple):
    """An address of the host, and the MAC addresses of other machines that have it."""

    address: str
    others: list[str]


def observe(home: Home) -> list[Seen]:
    """Asks the network who has the IPv4 address that nodes advertise; WireGuard, for example, has no ARP."""
    own = address.advertised(home)
    if not own:
        return []
    macs = macs_in(command.output_of(["ip", "-o", "link"], 3))
    placed = command.output_of(["ip", "-4", "-o", "address", "show", "to", own], 3).splitlines()
    interfaces = [name for line in placed for name in line.split()[1:2] if name in macs]
    try:
        return [Seen(own, _others(name, own, frozenset(macs.values()))) for name in interfaces]
    except OSError:  # a container may not, or the interface is down
        return []


def macs_in(links: str) -> dict[str, str]:
    """Returns the MAC address of each interface with ARP, from what ``ip -o link`` prints."""
    found = (_LINK.match(line) for line in links.splitlines())
    return {one[1]: one[3] for one in found if one and "NOARP" not in one[2].split(",")}


def _others(interface: str, own: str, macs: frozenset[str]) -> list[str]:
    """The MAC addresses of machines that answer for ``own``. This host's other interfaces may, too."""
    found: list[str] = []
    with socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ARP)) as line:
        line.bind((interface, _ARP))
        line.send(probe(line.getsockname()[4], own))
        end = time.monotonic() + _AWAITED
        while len(found) < _MOST and time.monotonic() < end:
            line.settimeout(max(0.001, end - time.monotonic()))
            try:
                mac = sender(line.recv(64), own)
            except socket.timeout:
                break
            if mac and mac not in macs and mac not in found:
                found.append(mac)
    return found


def probe(mac: bytes, own: str) -> bytes:
    """The frame that asks who has ``own``, without an address of who asks, so that no machine keeps it."""
    nobody = bytes(4)
    return (
        b"\xff" * 6 + mac + _ARP.to_bytes(2, "big") + _PROBE + mac + nobody + bytes(6) + socket.inet_aton(own)
    )


def sender(frame: bytes, own: str) -> str:
    """Returns the MAC address of whoever says in ``frame`` that it has ``own``; empty text if it does not."""
    packet = frame[14:42]
    if len(packet) < 28 or packet[:6] != _PROBE[:6] or packet[14:18] != socket.inet_aton(own):
        return ""
    return ":".join(f"{byte:02x}" for byte in packet[8:14])


def judge(seen: Seen, host: str) -> Judged:
    """Names the machines that have the host's address, too."""
    if not seen.others:
        return Judged("ok", f"no other machine has {seen.address}")
    text = f"another machine ({', '.join(seen.others)}) has its address {seen.address}, too"
    return Judged(
        "bad",
        text,
        "`ip neigh` on other hosts, or the router, shows which one it is; give it another address",
    )
