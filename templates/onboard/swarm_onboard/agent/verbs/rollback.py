"""``rollback``: bring the host to a release that it has kept."""

from __future__ import annotations

from swarm_onboard.agent import lease, lock, transaction, way_back
from swarm_onboard.agent.change import Change
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.messages import ApplyAnswer, RollbackRequest


def handle(request: RollbackRequest, payload: bytes, report: Report) -> ApplyAnswer:
    """Applies the kept release as ``apply`` does. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request["swarm"])
    to, chosen = release_name(request["next"]), request["secrets"]
    with lease.held_for(home, request):
        if home.known_manifest(to) is None:
            raise RefusedError(f"release {to} is not on the host any more", "deploy the spec that makes it")
        units = way_back.units(home, to, chosen)
        change = Change(
            txid=release_name(request["txid"]),
            who=lock.operator_in(request),
            run=str(request.get("run", "")),
            previous=request["previous"],
            next=to,
            stop=units["stop"],
            start=units["start"],
            restart=units["restart"],
            reload=[],
            reload_units=units["reload"],
            confirm_within=min(float(request.get("confirm_within", 0)), 3600.0),
            values={},
            secrets=chosen,
            stop_robots=bool(request.get("stop_robots")),
        )
        return transaction.run(home, change, b"", report)
