"""The network of a sealed swarm's WireGuard, as the spec has it."""

from __future__ import annotations

import ipaddress
from typing import Annotated

from pydantic import AfterValidator

from swarmctl.field_types import Subnet

_LONGEST_PREFIX = 20  # bits: addresses of hosts follow from their names, and no two may be the same


def _large(value: str) -> str:
    network = ipaddress.ip_network(value)
    if network.version == 6 or network.prefixlen > _LONGEST_PREFIX:
        raise ValueError(f"`{value}` is not an IPv4 subnet of 4096 addresses or more, like 10.200.0.0/16")
    return value


Overlay = Annotated[Subnet, AfterValidator(_large)]
