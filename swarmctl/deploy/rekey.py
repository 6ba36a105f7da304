"""Changes the WireGuard keys of hosts, and takes a lost host's key from the others.

Hosts keep the keys that they know outside of releases. First every peer knows the next key of a host, then
the host changes to it, and only then the old one is retired: whatever ends on the way, both ends have a key
in common, and the same command goes on from there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

from swarm_onboard.agent.verbs import wireguard_key
from swarm_onboard.agent.verbs.wireguard_key import Answer, Request
from swarm_onboard.tunnel.keys import Keys, is_key, line, lines_of

from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import results_of
from swarmctl.remote.transport import HostError, Kind, Target, Transport
from swarmctl.swarm.resolved import Swarm
from swarmctl.swarm.wireguard_routes import routes_of
from swarmctl.yamltext import hostlist

_PARALLEL, _TIMEOUT = 32, 30.0  # s


def exchanged(
    requests: Mapping[str, wireguard_key.Request], targets: Mapping[str, Target], transport: Transport
) -> Mapping[str, wireguard_key.Answer | HostError]:
    """Returns the keys of each host after its request, or its error."""
    events = ask_each(
        wireguard_key.handle, requests, targets, transport, parallel=_PARALLEL, timeout=_TIMEOUT
    )
    return {host: _checked(found) for host, found in results_of(events).items()}


def _checked(found: wireguard_key.Answer | HostError) -> wireguard_key.Answer | HostError:
    if isinstance(found, HostError) or (is_key(found.public) and (not found.next or is_key(found.next))):
        return found
    return HostError(Kind.PROTOCOL, "its public WireGuard key is not 32 bytes in base64")


Exchange = Callable[[Mapping[str, Request]], Mapping[str, Answer | HostError]]


class PinnedKeys(Protocol):
    """The operator's file of keys."""

    text: str

    @property
    def keys(self) -> Keys:
        """The keys in it."""

    def add(self, lines: str) -> None:
        """Joins lines to it, on the disk."""


@dataclass(frozen=True)
class Rekeyed:
    """The hosts that have ``changed`` their key; those that have ``kept`` it, and why; those that do not know
    all keys and which are retired, and why."""

    changed: tuple[str, ...]
    kept: Mapping[str, HostError]
    behind: Mapping[str, HostError]


def members(swarm: Swarm) -> list[str]:
    """Returns the hosts that have WireGuard, in the order of the spec, without those that were expelled."""
    inside = {name for island in swarm.islands for name in island.hosts}
    return [name for name in swarm.hosts if name in inside and name not in swarm.keys.expelled]


def rekey(swarm: Swarm, chosen: Iterable[str], pins: PinnedKeys, exchange: Exchange) -> Rekeyed:
    """Has each host make a key and change to it once all its peers know it."""
    following, kept = _next_keys(
        exchange({host: Request(swarm.name, make_next=True) for host in chosen}), pins.keys.live
    )
    pins.add("".join(line(host, key) for host, key in following.items()))
    behind = _inform(swarm, pins, exchange)
    for host in following:
        waits = sorted(behind.keys() & routes_of(swarm, host).keys())
        if host in behind or waits:
            kept[host] = behind.get(host) or HostError(
                Kind.HELD,
                f"{hostlist.written(waits)} does not know its next key",
                "run the same command again once it answers; or `swarmctl expel` it if it is lost",
            )
    done = exchange(
        {host: Request(swarm.name, use=key) for host, key in following.items() if host not in kept}
    )
    kept |= _errors(done)
    changed = tuple(host for host in done if host not in kept)
    live = pins.keys.live
    old = [(host, key) for host in changed for key in live[host] if key != following[host]]
    pins.add("".join(line(host, key, retired=True) for host, key in old))
    return Rekeyed(changed, kept, {**behind, **(_inform(swarm, pins, exchange) if old else {})})


def expel(swarm: Swarm, lost: str, pins: PinnedKeys, exchange: Exchange) -> Mapping[str, HostError]:
    """Retires every key of a host, here and on all others. Returns the errors of those that accept it yet."""
    pins.add("".join(line(lost, key, retired=True) for key in pins.keys.live.get(lost, ())))
    return _inform(swarm, pins, exchange, expel=lost)


def _next_keys(
    found: Mapping[str, Answer | HostError], live: Mapping[str, tuple[str, ...]]
) -> tuple[dict[str, str], dict[str, HostError]]:
    """The key to which each host changes; one that an earlier run has changed has it already."""
    following, kept = {}, {}
    for host, one in found.items():
        own = live.get(host, ())
        if isinstance(one, HostError):
            kept[host] = one
        elif one.public not in own:
            kept[host] = HostError(
                Kind.REFUSED, "its WireGuard key is not the pinned one", "`swarmctl trust` compares the keys"
            )
        else:
            following[host] = one.next if one.public == own[0] else one.public
    return following, kept


def _inform(swarm: Swarm, pins: PinnedKeys, exchange: Exchange, expel: str = "") -> dict[str, HostError]:
    """Sends every host the keys of its peers. Returns the errors."""
    hosts = [host for host in members(swarm) if host != expel]
    requests = {
        host: Request(swarm.name, known=lines_of(pins.text, (host, *routes_of(swarm, host))), expel=expel)
        for host in hosts
    }
    return _errors(exchange(requests))


def _errors(found: Mapping[str, Answer | HostError]) -> dict[str, HostError]:
    return {host: one for host, one in found.items() if isinstance(one, HostError)}
