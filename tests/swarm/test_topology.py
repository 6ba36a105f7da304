"""What the graph of hosts and networks says is what the links of the spec list."""

from __future__ import annotations

from itertools import product

from hypothesis import given, settings

from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.wireguard_routes import Networks
from tests.swarm.random_swarms import Data, index_of, swarms


def listed(index: SwarmIndex, *hosts: str) -> list[int]:
    """The networks that list all hosts, in the order of the spec."""
    return [number for number, link in index.networks if set(hosts) <= set(link.hosts)]


@settings(max_examples=100)
@given(swarms())
def test_two_hosts_share_the_networks_that_list_both(data: Data) -> None:
    index = index_of(data)
    for one, other in product(data["hosts"], repeat=2):
        assert index.shared_networks(one, other) == listed(index, one, other)
        assert index.meet(one, other) == (one == other or bool(listed(index, one, other)))


@settings(max_examples=100)
@given(swarms())
def test_a_relay_shares_a_network_with_both_and_a_hub_comes_first(data: Data) -> None:
    index = index_of(data)
    hubs = [island.hub for island in index.islands]
    others = [host for island in index.islands for host in island.hosts if host not in hubs]
    for one, other in product(data["hosts"], repeat=2):
        between = [host for host in (*hubs, *others) if host not in (one, other)]
        able = [host for host in between if listed(index, one, host) and listed(index, host, other)]
        if index.networks:
            assert Networks(index).relay(one, other) == next(iter(able), None)
