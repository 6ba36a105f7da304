"""``rollback``: bring the host to a release that it has kept."""

from __future__ import annotations

from swarm_onboard.agent import lease, lock, rollback, transaction
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.record import Change
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.steps import TAKEN


class Request(NamedTuple):
    """Bring the host from release ``previous`` to ``next`` with its set ``secrets``, empty for none; it has
    kept both. ``confirm_within``, ``stop_robots`` and ``issued`` as for ``apply``."""

    swarm: str
    txid: str
    previous: str | None
    next: str
    secrets: str
    confirm_within: float = 0.0
    who: str = ""
    wait: float = 2.0
    run: str = ""
    stop_robots: bool = False
    issued: float = 0.0


Answer = transaction.Applied


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Applies the kept release as ``apply`` does. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request.swarm)
    to, chosen = release_name(request.next), request.secrets
    with lease.held_for(home, request):
        if home.known_manifest(to) is None:
            raise RefusedError(f"release {to} is not on the host any more", "deploy the spec that makes it")
        change = Change(
            txid=release_name(request.txid),
            who=lock.operator_in(request),
            run=str(request.run),
            previous=request.previous,
            next=to,
            steps=[step for step in rollback.steps_back(home, to, chosen) if step.kind in TAKEN],
            confirm_within=min(float(request.confirm_within), 3600.0),
            values={},
            secrets=chosen,
            stop_robots=bool(request.stop_robots),
            issued=float(request.issued),
        )
        return transaction.run(home, change, b"", report)
