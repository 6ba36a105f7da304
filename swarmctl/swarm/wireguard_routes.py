"""Which hosts of a sealed swarm exchange packets through a third one: those that share no network. Pure."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.swarm.addresses import Ip, Subnet
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Swarm

Relays = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class Networks:
    """The hosts of each network with its subnet, the addresses of hosts, and those that relay, best first."""

    members: Sequence[tuple[Collection[str], Subnet | None]]
    addresses: Mapping[str, Ip | None]
    candidates: Sequence[str]

    def joins(self, one: str, other: str) -> bool:
        """Returns True if one of two hosts can send to the address of the other, which answers its sender."""
        return not self.members or any(
            one in hosts and other in hosts and self._has_address(subnet, one, other)
            for hosts, subnet in self.members
        )

    def _has_address(self, subnet: Subnet | None, *hosts: str) -> bool:
        ips = [self.addresses[host] for host in hosts]
        return subnet is None or any(ip is not None and ip in subnet for ip in ips)

    def relay(self, one: str, other: str) -> str | None:
        """Returns the host through which two others exchange packets; None if no host can."""
        return next(
            (
                host
                for host in self.candidates
                if host not in (one, other) and self.joins(one, host) and self.joins(host, other)
            ),
            None,
        )

    def relays(self, peers: Mapping[str, Collection[str]]) -> Relays:
        """Returns by host its peers that share no network with it, each with the host that relays."""
        found: dict[str, dict[str, str]] = {}
        for host, others in sorted(peers.items()):
            for other in sorted(others):
                if not self.joins(host, other) and (relay := self.relay(*sorted((host, other)))):
                    found.setdefault(host, {})[other] = relay
        return found


def networks_of(index: SwarmIndex) -> Networks:
    """Returns the networks of a spec. Hubs relay for others before hosts that are none."""
    members = [(index.members[number], index.subnets[number]) for number, _ in index.networks]
    hubs = [island.hub for island in index.islands]
    inside = [host for island in index.islands for host in island.hosts]
    return Networks(members, index.addresses, tuple(dict.fromkeys((*hubs, *inside))))


def routes_of(swarm: Swarm, host: str) -> Mapping[str, tuple[str, ...]]:
    """Returns the WireGuard peers of a host, each with the hosts behind it."""
    relayed = swarm.relays.get(host, {})
    found: dict[str, list[str]] = {one: [] for one in sorted(swarm.peers.get(host, ())) if one not in relayed}
    for other, relay in relayed.items():
        found.setdefault(relay, []).append(other)
    for one in ends_of(swarm, host):
        found.setdefault(one, [])
    return {name: tuple(behind) for name, behind in found.items()}


def ends_of(swarm: Swarm, relay: str) -> list[str]:
    """Returns the hosts for which a host relays."""
    return [one for one, routes in swarm.relays.items() if relay in routes.values()]
