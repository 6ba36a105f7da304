"""``keep_secrets``: store secrets for the units that read them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarm_agent import lease, secrets
from swarm_agent.release_store import home_of
from swarm_agent.rpc import Report

if TYPE_CHECKING:
    from swarm_agent.messages import KeepSecretsAnswer, KeepSecretsRequest


def handle(request: KeepSecretsRequest, payload: bytes, report: Report) -> KeepSecretsAnswer:
    """Stores secrets for the units that read them. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request["swarm"])
    values = secrets.offered(payload)
    with lease.held_for(home, request):
        secrets.keep(home, values)
    return {"kept": sorted(values)}
