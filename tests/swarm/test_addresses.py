"""Addresses are classified, and a network's subnet is inferred from its own hosts."""

from __future__ import annotations

import ipaddress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.swarm.addresses import (
    Kind,
    Scheme,
    ip_of,
    kind,
    means_self,
    normal,
    scheme,
    smallest_subnet,
    usual_subnet,
    usual_subnets,
)
from swarmctl.swarm.index import SwarmIndex


@pytest.mark.parametrize(
    ("address", "what"),
    [
        ("192.168.77.10", Kind.ORDINARY),
        ("223.255.255.254", Kind.ORDINARY),
        ("0.0.0.0", Kind.UNSPECIFIED),
        ("127.0.1.1", Kind.LOOPBACK),
        ("169.254.0.1", Kind.LINK_LOCAL),
        ("169.253.0.1", Kind.ORDINARY),
        ("224.0.0.1", Kind.GROUP),
        ("239.255.255.255", Kind.GROUP),
        ("240.0.0.1", Kind.RESERVED),
        ("255.255.255.255", Kind.RESERVED),
        ("::1", Kind.IPV6),
    ],
)
def test_the_use_of_an_address(address: str, what: Kind) -> None:
    found = ip_of(address)
    assert found is not None
    assert kind(found) is what


@given(st.ip_addresses(v=4))
def test_kinds_agree_with_the_standard_library(ip: ipaddress.IPv4Address) -> None:
    assert (kind(ip) is Kind.GROUP) == ip.is_multicast
    assert (kind(ip) is Kind.LOOPBACK) == ip.is_loopback
    assert (kind(ip) is Kind.LINK_LOCAL) == ip.is_link_local
    assert (kind(ip) is Kind.RESERVED) == ip.is_reserved


@pytest.mark.parametrize(
    ("address", "how"),
    [
        ("10.0.0.1", Scheme.IP),
        ("k3-pi", Scheme.NAME),
        ("k3-pi.LOCAL.", Scheme.MDNS),
        ("local.example", Scheme.NAME),
    ],
)
def test_how_a_host_address_is_resolved(address: str, how: Scheme) -> None:
    assert scheme(address) is how


def test_the_canonical_spelling_of_an_address() -> None:
    assert normal("K3-Pi.local.") == normal("k3-pi.local")
    assert normal("FE80:0::1") == normal("fe80::1")
    assert means_self("LocalHost.")
    assert not means_self("192.168.77.10")


@given(st.lists(st.ip_addresses(v=4), min_size=1, max_size=20))
def test_the_smallest_subnet_has_every_address_as_a_host(ips: list[ipaddress.IPv4Address]) -> None:
    inside = [ip for ip in ips if kind(ip) is Kind.ORDINARY]
    if not inside:
        return
    found = smallest_subnet(inside)
    assert all(ip in found and ip not in (found[0], found[-1]) for ip in inside)


@given(st.lists(st.ip_addresses(v=4), max_size=20))
def test_every_address_is_in_one_of_the_usual_subnets(ips: list[ipaddress.IPv4Address]) -> None:
    assert set(usual_subnets(ips)) == {usual_subnet(ip) for ip in ips}


SPEC = """
version: 1
name: two
mode: leader
leader: laptop
hosts:
  laptop: {address: 10.0.0.1}
  k3-pi: {address: 192.168.77.11}
  epuck-pi: {address: 192.168.77.12}
  named: {address: named.example}
robots: {koala: {type: koala, host: laptop}}
links:
"""


@pytest.mark.parametrize(
    ("networks", "subnets"),
    [
        (["{kind: wlan, name: a, hosts: [k3-pi, epuck-pi]}"], ["192.168.77.0/24"]),
        (["{kind: wlan, name: a, hosts: [k3-pi], subnet: 10.9.0.0/16}"], ["10.9.0.0/16"]),
        (["{kind: wlan, name: a, hosts: [laptop, k3-pi]}"], [None]),
        (["{kind: wlan, name: a, hosts: [named]}"], [None]),
        (
            [
                "{kind: wlan, name: a, hosts: [laptop, k3-pi, epuck-pi]}",
                "{kind: ethernet, name: b, hosts: [laptop]}",
            ],
            ["192.168.77.0/24", "10.0.0.0/24"],
        ),
    ],
)
def test_a_host_on_two_networks_does_not_hide_their_subnets(
    networks: list[str], subnets: list[str | None]
) -> None:
    text = SPEC + "".join(f"  - {one}\n" for one in networks)
    document, _ = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None
    found = SwarmIndex(document).subnets
    assert [str(one) if one else None for one in found.values()] == subnets
