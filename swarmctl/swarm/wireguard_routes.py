"""Which hosts of a sealed swarm exchange packets through a third one: those that share no network. Pure."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Swarm

Relays = Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class Networks:
    """The networks of a spec, and which hosts exchange packets over them."""

    index: SwarmIndex

    @cached_property
    def _candidates(self) -> tuple[str, ...]:
        """The hosts that may relay, best first: hubs before hosts that are none."""
        islands = self.index.islands
        inside = (host for island in islands for host in island.hosts)
        return tuple(dict.fromkeys((*(island.hub for island in islands), *inside)))

    def joins(self, one: str, other: str) -> bool:
        """Returns True if one of two hosts can send to the address of the other, which answers its sender."""
        on, addressed = self._joined, self._addressed
        return not self.index.networks or not (
            on[one].isdisjoint(addressed[other]) and addressed[one].isdisjoint(on[other])
        )

    @cached_property
    def _joined(self) -> Mapping[str, frozenset[int]]:
        """The networks of each host. As sets, because pairs of hosts are many."""
        return {host: frozenset(self.index.topology[host]) for host in self.index.spec.hosts}

    @cached_property
    def _addressed(self) -> Mapping[str, frozenset[int]]:
        """Those of them in which its address is, or whose subnet is not known."""
        return {
            host: frozenset(number for number in networks if self._has_address(number, host))
            for host, networks in self._joined.items()
        }

    def _has_address(self, network: int, host: str) -> bool:
        subnet, ip = self.index.subnets[network], self.index.addresses[host]
        return subnet is None or (ip is not None and ip in subnet)

    def relay(self, one: str, other: str) -> str | None:
        """Returns the host through which two others exchange packets; None if no host can."""
        return next(
            (
                host
                for host in self._candidates
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
