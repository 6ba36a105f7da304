"""``apply``: bring the host to another release."""

from __future__ import annotations

from contextlib import suppress

from swarm_onboard.agent import known_keys, lease, lock, secrets, systemd, transaction, upload
from swarm_onboard.agent.change import Change
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.failpoint import passed
from swarm_onboard.agent.manifest import release_name, unit_names
from swarm_onboard.agent.paths import READERS
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.messages import ApplyAnswer, ApplyRequest


def handle(request: ApplyRequest, payload: bytes, report: Report) -> ApplyAnswer:
    """Applies a release as one transaction. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request["swarm"])
    previous = request.get("previous")
    values, archive = _parts(request, payload)
    change = Change(
        txid=release_name(request["txid"]),
        who=lock.operator_in(request),
        run=str(request.get("run", "")),
        previous=None if previous is None else release_name(previous),
        next=release_name(request["next"]),
        stop=unit_names(request.get("stop", [])),
        start=unit_names(request.get("start", [])),
        restart=unit_names(request.get("restart", [])),
        reload=[name for name in request.get("reload", []) if name in READERS],
        reload_units=unit_names(request.get("reload_units", [])),
        confirm_within=min(float(request.get("confirm_within", 0)), 3600.0),
        values=secrets.offered(values),
        stop_robots=bool(request.get("stop_robots")),
        files_only=bool(request.get("files_only")),
    )
    if not systemd.present(home):
        raise RefusedError("this host does not run systemd", "swarmctl needs a host that boots with systemd")
    with lease.held_for(home, request):
        passed("lock")
        known_keys.learn(home, str(request.get("wireguard_keys", "")))
        return transaction.run(home, change, archive, report)


def interrupted(request: ApplyRequest, received: bytes) -> None:
    """Keeps the files of an upload that ended early, if this run still has the lease."""
    home = home_of(request["swarm"])
    with suppress(RefusedError, OSError), lease.held_for(home, request):
        upload.keep(home, release_name(request["next"]), _parts(request, received)[1])


def _parts(request: ApplyRequest, payload: bytes) -> tuple[bytes, bytes]:
    """The secrets and the archive in a payload."""
    size = max(0, int(request.get("secrets", 0)))
    return payload[:size], payload[size:]
