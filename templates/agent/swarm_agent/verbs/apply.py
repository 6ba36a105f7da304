"""``apply``: bring the host to another release.

Request: ``swarm``, ``base`` (digest or null), ``next`` (digest), ``stop``, ``start``, ``restart`` (units),
``reload`` (keys of ``systemd.READERS``), ``who``, ``txid``, ``wait`` (s for the lock). Payload: a tar.gz,
the manifest first; none if the host has the release already. Answer: ``release``, ``previous``, ``units``.
"""

from __future__ import annotations

import os
from typing import Any

from swarm_agent import lock, systemd, transaction
from swarm_agent.errors import RefusedError
from swarm_agent.failpoint import passed
from swarm_agent.home import Home
from swarm_agent.manifest import release_name, swarm_name, unit_names
from swarm_agent.wire import Report


def handle(request: dict[str, Any], payload: bytes, report: Report) -> dict[str, Any]:
    home = Home(swarm_name(request["swarm"]), os.environ.get("SWARM_PREFIX", ""))
    base = request.get("base")
    change = transaction.Change(
        txid=release_name(request["txid"]),
        who=str(request.get("who", ""))[:200],
        base=None if base is None else release_name(base),
        next=release_name(request["next"]),
        stop=unit_names(request.get("stop", [])),
        start=unit_names(request.get("start", [])),
        restart=unit_names(request.get("restart", [])),
        reload=[name for name in request.get("reload", []) if name in systemd.READERS],
    )
    if not systemd.present(home):
        raise RefusedError("this host does not run systemd", "swarmctl needs a host that boots with systemd")
    with lock.held(home, change.who, min(float(request.get("wait", 2)), 60)):
        passed("lock")
        return transaction.run(home, change, payload, report)
