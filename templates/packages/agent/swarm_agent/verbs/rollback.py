"""``rollback``: bring the host to a release that it has kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarm_agent import files, lease, lock, transaction
from swarm_agent.errors import RefusedError
from swarm_agent.manifest import NAME, release_name
from swarm_agent.release_store import Home, home_of
from swarm_agent.rpc import Report

if TYPE_CHECKING:
    from swarm_agent.messages import ApplyAnswer, RollbackRequest


def handle(request: RollbackRequest, payload: bytes, report: Report) -> ApplyAnswer:
    """Applies the kept release as ``apply`` does. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request["swarm"])
    to = release_name(request["next"])
    with lease.held_for(home, request):
        before, after = _units(home, request["base"]), _units(home, to)
        if home.known_manifest(to) is None:
            raise RefusedError(f"release {to} is not on the host any more", "deploy the spec that makes it")
        change = transaction.Change(
            txid=release_name(request["txid"]),
            who=lock.operator_in(request),
            run=str(request.get("run", "")),
            base=request["base"],
            next=to,
            stop=[unit for unit in before if unit not in after],
            start=[unit for unit in after if unit not in before],
            restart=[unit for unit in after if unit in before and after[unit] != before[unit]],
            reload=[],
            confirm_within=min(float(request.get("confirm_within", 0)), 3600.0),
            stop_robots=bool(request.get("stop_robots")),
        )
        return transaction.run(home, change, b"", report)


def _units(home: Home, digest: str | None) -> dict[str, str]:
    """The digests of the units of a release, by name."""
    raw = files.read_json(f"{home.release(release_name(digest))}/{NAME}") if digest else None
    return {unit["name"]: unit["digest"] for unit in raw["units"]} if raw else {}
