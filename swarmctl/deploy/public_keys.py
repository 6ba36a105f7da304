"""The public WireGuard keys of hosts. A host without a key makes one, and keeps the private part."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from swarm_onboard.agent.messages import WireguardKeyAnswer
from swarm_onboard.tunnel.keys import is_key

from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.transport import HostError, Kind, Session, Target, Transport

_VERBS = ("wireguard_key",)
_PARALLEL, _TIMEOUT = 32, 30.0  # s


def exchanged(
    swarm: str, requests: Mapping[str, Mapping[str, Any]], targets: Mapping[str, Target], transport: Transport
) -> Mapping[str, WireguardKeyAnswer | HostError]:
    """Returns the keys of each host after its request, as ``WireguardKeyRequest`` has it, or its error."""

    def work(session: Session, target: Target, _note: Callable[[str], None]) -> WireguardKeyAnswer:
        request = {"verb": "wireguard_key", "swarm": swarm, **requests[target.host]}
        with agent_client.agent_session(session, verbs=_VERBS) as host:
            answer: WireguardKeyAnswer = host.request(request, timeout=_TIMEOUT)
        if not is_key(answer["public"]) or not (answer["next"] == "" or is_key(answer["next"])):
            raise HostError(Kind.PROTOCOL, "its public WireGuard key is not 32 bytes in base64")
        return answer

    chosen = [targets[host] for host in requests]
    events = parallel_hosts.run(chosen, work, transport=transport, parallel=_PARALLEL)
    ends = (one for one in events if isinstance(one, parallel_hosts.Finished | parallel_hosts.Skipped))
    return {one.host: parallel_hosts.result_of(one) for one in ends}
