"""What rules of nftables decide, from the JSON that `nft -j list ruleset` prints (libnftables-json(5)).

It knows no more than the rules' own words: a word that it does not know is an error.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Packet:
    """A packet of a host. ``account``: the number of the account that sends it; ``connections``: how many of
    TCP its sender has open; ``flags``: of TCP; ``origin``: the port from which it comes."""

    source: str
    to: str
    port: int
    protocol: str = "tcp"
    flags: frozenset[str] = frozenset({"syn"})
    state: str = "new"
    interface: str = "wlan0"
    account: int = 0
    connections: int = 1
    origin: int = 50000
    direction: str = "original"


def verdict(ruleset: Any, table: str, chain: str, packet: Packet) -> str:
    """Returns `accept`, `drop` or `reject`: of the first rule that fits, else the chain's policy."""
    policy = ""
    for one in _entries(ruleset, table):
        if "chain" in one and one["chain"]["name"] == chain:
            policy = one["chain"]["policy"]
        if "rule" in one and one["rule"]["chain"] == chain:
            decided = _decided(one["rule"]["expr"], packet)
            if decided:
                return decided
    assert policy, f"table {table} has no chain {chain}"
    return policy


def _entries(ruleset: Any, table: str) -> Iterator[Any]:
    for one in ruleset["nftables"]:
        (kind, value), *_ = one.items()
        if kind in ("chain", "rule") and value["table"] == table:
            yield one


def _decided(expressions: Any, packet: Packet) -> str:
    for one in expressions:
        ((kind, value),) = one.items()
        if kind in ("accept", "drop", "reject"):
            return str(kind)
        if kind == "match":
            if not _matches(value, packet):
                return ""
        elif kind == "ct count":
            if (packet.connections > value["val"]) != value["inv"]:
                return ""
        else:
            raise AssertionError(f"unknown expression {one}")
    return ""


def _matches(match: Any, packet: Packet) -> bool:
    seen = _value(match["left"], packet)
    if seen is None:  # the packet has no such field: it is of another protocol
        return False
    found = _is_in(seen, match["right"])
    assert match["op"] in ("==", "!=", "in"), match
    return found != (match["op"] == "!=")


def _value(left: Any, packet: Packet) -> Any:
    ((kind, value),) = left.items()
    if kind == "meta":
        return {"iif": packet.interface, "oif": packet.interface, "skuid": packet.account}[value["key"]]
    if kind == "ct":
        return {"state": packet.state, "direction": packet.direction}[value["key"]]
    if kind == "&":
        field, mask = value
        flags = _value(field, packet)
        return flags and flags & frozenset(mask)
    assert kind == "payload", left
    protocol, field = value["protocol"], value["field"]
    if protocol in ("ip", "ip6"):
        address = ipaddress.ip_address({"saddr": packet.source, "daddr": packet.to}[field])
        return address if address.version == (4 if protocol == "ip" else 6) else None
    if protocol != packet.protocol:
        return None
    return {"sport": packet.origin, "dport": packet.port, "flags": packet.flags}[field]


def _is_in(seen: Any, right: Any) -> bool:
    if isinstance(seen, frozenset):
        return bool(seen == frozenset([right] if isinstance(right, str) else right))
    if isinstance(right, list):
        return any(_is_in(seen, one) for one in right)
    if isinstance(right, dict):
        ((kind, value),) = right.items()
        if kind == "set":
            return any(_is_in(seen, one) for one in value)
        if kind == "range":
            first, last = (type(seen)(one) if isinstance(one, str) else one for one in value)
            return bool(first <= seen <= last)
        raise AssertionError(f"unknown value {right}")
    if isinstance(seen, (ipaddress.IPv4Address, ipaddress.IPv6Address)):
        return seen == ipaddress.ip_address(right)
    return bool(seen == right)
