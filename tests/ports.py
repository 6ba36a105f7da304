"""TCP ports for tests that need a free one before the server starts."""

from __future__ import annotations

import random
import socket
from pathlib import Path

_EPHEMERAL = Path("/proc/sys/net/ipv4/ip_local_port_range")


def free_port() -> int:
    """Returns a port of 127.0.0.1 on which nothing listens.

    It lies below those that the kernel gives out by itself (ip(7), ``ip_local_port_range``): one of these
    may belong to another test's connection or server a moment later.
    """
    first = int(_EPHEMERAL.read_text().split()[0])
    while True:
        port = random.randrange(first // 2, first)
        with socket.socket() as one:
            if one.connect_ex(("127.0.0.1", port)) != 0:
                return port
