"""The public WireGuard keys of hosts. A host without a key makes one, and keeps the private part."""

from __future__ import annotations

from collections.abc import Mapping

from swarm_onboard.agent.verbs import wireguard_key
from swarm_onboard.tunnel.keys import is_key

from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import results_of
from swarmctl.remote.transport import HostError, Kind, Target, Transport

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
