"""Has the kernel forward packets that come out of one interface. Source: rtnetlink(7), linux/if_link.h.

By netlink, not below /proc/sys, which units and containers may not write.
"""

from __future__ import annotations

import os
import socket
import struct

_NEW_LINK, _REQUEST, _ACK, _ERROR = 16, 0x1, 0x4, 2
_AF_SPEC, _INET_CONF, _FORWARDING, _NESTED = 26, 1, 1, 0x8000  # the third is IPV4_DEVCONF_FORWARDING
_HEADER, _LINK = struct.Struct("=IHHII"), struct.Struct("=BxHiII")
_TIMEOUT = 5.0  # s


def forward_from(interface: str) -> None:
    """Forwards what comes out of the interface, over IPv4. Raises ``OSError``."""
    value = _attribute(_FORWARDING, struct.pack("=I", 1))
    spec = _nested(_AF_SPEC, _nested(socket.AF_INET, _nested(_INET_CONF, value)))
    body = _LINK.pack(socket.AF_UNSPEC, 0, socket.if_nametoindex(interface), 0, 0) + spec
    header = _HEADER.pack(_HEADER.size + len(body), _NEW_LINK, _REQUEST | _ACK, 1, 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as link:
        link.settimeout(_TIMEOUT)
        link.send(header + body)
        answer = link.recv(4096)
    _, kind, *_ = _HEADER.unpack_from(answer)
    (error,) = struct.unpack_from("=i", answer, _HEADER.size)
    if kind != _ERROR or error:
        raise OSError(-error, f"{interface} does not forward: {os.strerror(-error)}")


def _nested(kind: int, content: bytes) -> bytes:
    return _attribute(kind | _NESTED, content)


def _attribute(kind: int, content: bytes) -> bytes:
    """A netlink attribute, whose content is a multiple of 4 bytes here."""
    return struct.pack("=HH", 4 + len(content), kind) + content
