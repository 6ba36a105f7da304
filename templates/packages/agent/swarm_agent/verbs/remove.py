"""``remove``: take the swarm off the host."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from swarm_agent import lock, transaction
from swarm_agent.release_store import home_of
from swarm_agent.rpc import Report

if TYPE_CHECKING:
    from swarm_agent.messages import RemoveAnswer, RemoveRequest


def handle(request: RemoveRequest, payload: bytes, report: Report) -> RemoveAnswer:
    """Takes the swarm off the host. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request["swarm"])
    if not os.path.isdir(home.path):
        return {"removed": False}
    with lock.held_for(home, request):
        transaction.withdraw(home, report)
    return {"removed": True}
