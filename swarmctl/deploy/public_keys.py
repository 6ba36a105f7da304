"""Fetches the public WireGuard keys of hosts. A host without a key makes one, and keeps the private part."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping

from swarm_onboard.agent.messages import WireguardKeyAnswer, WireguardKeyRequest

from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.transport import HostError, Kind, Session, Target, Transport

_VERBS = ("wireguard_key",)
_PARALLEL, _TIMEOUT = 32, 30.0  # s
_KEY = re.compile(r"[A-Za-z0-9+/]{42}[AEIMQUYcgkosw048]=")  # 32 bytes in base64


def public_keys(
    swarm: str, targets: Collection[Target], transport: Transport
) -> Mapping[str, str | HostError]:
    """Returns the public key of each host in base64, or why it could not be had."""

    def work(session: Session, _target: Target, _note: Callable[[str], None]) -> str:
        request: WireguardKeyRequest = {"verb": "wireguard_key", "swarm": swarm}
        with agent_client.agent_session(session, verbs=_VERBS) as host:
            answer: WireguardKeyAnswer = host.request(request, timeout=_TIMEOUT)
        if not _KEY.fullmatch(answer["public"]):
            raise HostError(Kind.PROTOCOL, "its public WireGuard key is not 32 bytes in base64")
        return answer["public"]

    events = parallel_hosts.run(targets, work, transport=transport, parallel=_PARALLEL)
    ends = (one for one in events if isinstance(one, parallel_hosts.Finished | parallel_hosts.Skipped))
    return {one.host: parallel_hosts.result_of(one) for one in ends}
