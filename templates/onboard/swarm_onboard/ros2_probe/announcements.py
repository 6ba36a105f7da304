"""Lets a node of Fast DDS find the others at once: what it announces waits until it listens.

A participant announces itself before it handles what it receives (``RTPSParticipantImpl::enable`` of Fast DDS
2 and 3). Those nearby answer a newcomer within 1 ms, and once: too early; they are found when they announce
themselves again, up to 3 s later. So the node has one peer, a socket of its own process, which sends the same
packets on to the others.
"""

from __future__ import annotations

import socket
import tempfile
import threading
from contextlib import suppress
from pathlib import Path
from typing import Callable, Iterator, MutableMapping, Sequence
from xml.etree import ElementTree

_NAMESPACE = "http://www.eprosima.com"
ElementTree.register_namespace("", _NAMESPACE)  # Fast DDS knows no prefixes
_IN = f"{{{_NAMESPACE}}}"
_PLAIN = (
    f'<dds xmlns="{_NAMESPACE}"><profiles><participant profile_name="swarm" is_default_profile="true"><rtps/>'
    "</participant></profiles></dds>"
)
_PROFILES = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")  # of Fast DDS 3, and of 2
_RANGE, _PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"
_LOOPBACK = {"udpv4": "127.0.0.1", "udpv6": "::1"}
_MOST_PARTICIPANTS = 32  # of a host among which rmw_fastrtps looks for peers, if the profile has no number
_LARGEST = 1 << 16  # bytes of a packet


def held(variables: MutableMapping[str, str]) -> Callable[[], None]:
    """Returns a function that sends on what the next node of this process has announced, and what it will.

    ``variables``: the environment, which is changed for that node. It stays, and the function does nothing,
    where no peers are listed: with a discovery server, by multicast, and with other middleware.
    """
    if "ROS_DISCOVERY_SERVER" in variables or "fastrtps" not in variables.get("RMW_IMPLEMENTATION", ""):
        return _nothing
    try:
        return _held(variables)
    except (OSError, ValueError, ElementTree.ParseError):  # a full disk, an edited file: it just takes longer
        return _nothing


def _held(variables: MutableMapping[str, str]) -> Callable[[], None]:
    """Raises any error before it has changed anything."""
    name = next((one for one in _PROFILES if one in variables), _PROFILES[0])
    text = Path(variables[name]).read_text("utf-8") if name in variables else _PLAIN
    root = ElementTree.fromstring(text)
    kind, peers = _peers(root, variables)
    if not peers:
        return _nothing
    most = int(root.findtext(f".//{_IN}maxInitialPeersRange", str(_MOST_PARTICIPANTS)))
    ports = _ports(int(variables.get("ROS_DOMAIN_ID", "0")), most)
    own = socket.socket(socket.AF_INET if kind == "udpv4" else socket.AF_INET6, socket.SOCK_DGRAM)
    own.bind((_LOOPBACK[kind], 0))
    _set_peer(root, kind, own.getsockname()[1])
    profile = tempfile.NamedTemporaryFile(suffix=".xml")  # noqa: SIM115  Fast DDS reads none without a name
    profile.write(ElementTree.tostring(root))
    profile.flush()
    variables[name] = profile.name
    variables[_RANGE] = "SYSTEM_DEFAULT"  # the other ranges add peers to those of the profile
    variables.pop(_PEERS, None)

    def send_on() -> None:
        profile.close()
        threading.Thread(target=_send_on, args=(own, peers, ports), daemon=True).start()

    return send_on


def _nothing() -> None:
    """Does nothing."""


def _peers(root: ElementTree.Element, variables: MutableMapping[str, str]) -> tuple[str, list[str]]:
    """Returns the kind of the locators, and the addresses of all hosts with nodes."""
    for kind in _LOOPBACK:
        found = root.iterfind(f".//{_IN}initialPeersList//{_IN}{kind}/{_IN}address")
        if addresses := [str(one.text) for one in found]:
            return kind, addresses
    if variables.get(_RANGE) != "LOCALHOST":
        return "", []
    return "udpv4", [_LOOPBACK["udpv4"], *filter(None, variables.get(_PEERS, "").split(";"))]


def _set_peer(root: ElementTree.Element, kind: str, port: int) -> None:
    """Replaces the peers of the profile by a port of this host, and turns multicast off as its template does.

    Raises ``ValueError`` if it has no default profile of a participant.
    """
    (rtps,) = root.iterfind(f".//{_IN}participant[@is_default_profile='true']/{_IN}rtps")
    for old in rtps.findall(f"{_IN}builtin"):
        rtps.remove(old)
    builtin = ElementTree.SubElement(rtps, f"{_IN}builtin")
    _locator(builtin, "metatrafficUnicastLocatorList", kind)
    peer = _locator(builtin, "initialPeersList", kind)
    ElementTree.SubElement(peer, f"{_IN}address").text = _LOOPBACK[kind]
    ElementTree.SubElement(peer, f"{_IN}port").text = str(port)


def _locator(parent: ElementTree.Element, name: str, kind: str) -> ElementTree.Element:
    listed = ElementTree.SubElement(parent, f"{_IN}{name}")
    return ElementTree.SubElement(ElementTree.SubElement(listed, f"{_IN}locator"), f"{_IN}{kind}")


def _ports(domain: int, most: int) -> list[int]:
    """Returns where the first participants of a host take announcements (DDSI-RTPS 2.5, section 9.6.2.3)."""
    return [7400 + 250 * domain + 10 + 2 * number for number in range(most)]


def _send_on(own: socket.socket, peers: Sequence[str], ports: Sequence[int]) -> None:
    addresses = [one for peer in peers for one in _resolved(peer, own.family)]
    with socket.socket(own.family, socket.SOCK_DGRAM) as to_others:
        to_others.setblocking(False)  # what waits for the address of a host that is off fills the buffer
        while True:
            packet = own.recv(_LARGEST)
            for port in ports:
                for address in addresses:
                    with suppress(OSError):  # there is no way, or a firewall
                        to_others.sendto(packet, (address, port))


def _resolved(peer: str, family: int) -> Iterator[str]:
    with suppress(OSError):
        yield str(socket.getaddrinfo(peer, None, family, socket.SOCK_DGRAM)[0][4][0])
