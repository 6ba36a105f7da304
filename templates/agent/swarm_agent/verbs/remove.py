"""``remove``: take the swarm off the host.

Request: ``swarm``, ``who``, ``wait``. Answer: ``removed``, whether it was there.
"""

from __future__ import annotations

import os
from typing import Any

from swarm_agent import lock, transaction
from swarm_agent.home import Home
from swarm_agent.manifest import swarm_name
from swarm_agent.wire import Report


def handle(request: dict[str, Any], payload: bytes, report: Report) -> dict[str, Any]:
    home = Home(swarm_name(request["swarm"]), os.environ.get("SWARM_PREFIX", ""))
    if not os.path.isdir(home.path):
        return {"removed": False}
    with lock.held(home, str(request.get("who", ""))[:200], min(float(request.get("wait", 2)), 60)):
        transaction.withdraw(home, report)
    return {"removed": True}
