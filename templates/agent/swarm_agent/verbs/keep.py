"""``keep``: keep secrets for the units that read them.

Request: ``swarm``, ``who``, ``wait``. Payload: a JSON object, name to value. Answer: ``kept``, the names.
"""

from __future__ import annotations

import os
from typing import Any

from swarm_agent import lock, vault
from swarm_agent.home import Home
from swarm_agent.manifest import swarm_name
from swarm_agent.wire import Report


def handle(request: dict[str, Any], payload: bytes, report: Report) -> dict[str, Any]:
    home = Home(swarm_name(request["swarm"]), os.environ.get("SWARM_PREFIX", ""))
    values = vault.offered(payload)
    with lock.held(home, str(request.get("who", ""))[:200], min(float(request.get("wait", 2)), 60)):
        vault.keep(home, values)
    return {"kept": sorted(values)}
