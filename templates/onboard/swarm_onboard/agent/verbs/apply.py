"""``apply``: bring the host to another release."""

from __future__ import annotations

from contextlib import suppress

from swarm_onboard.agent import known_keys, lease, lock, secrets, steps, systemd, transaction, upload
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.failpoint import passed
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.record import Change
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.steps import Step

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Sequence


class Request(NamedTuple):
    """Bring the host from release ``previous`` to release ``next`` (digests).

    ``steps``: those of the plan that are ``steps.TAKEN``; ``confirm_within``: s until it is undone unless it
    is confirmed, 0: no confirmation is needed; ``files_only``: nothing else changes, and it stays at once;
    ``wireguard_keys``: public ones that it keeps, whatever becomes of the change.
    The payload begins with new values of secrets, a JSON object by name of ``secrets`` bytes. A tar.gz
    follows, the manifest first, without files whose contents release ``previous`` has; it is empty if the
    host has the release already. ``stop_robots``: stop robots that move or are under command where the change
    would touch them, instead of refusing it; ``issued``: s since 1970, when ``who`` chose the release.
    """

    swarm: str
    txid: str
    previous: str | None
    next: str
    steps: Sequence[Step] = ()
    confirm_within: float = 0.0
    secrets: int = 0
    files_only: bool = False
    wireguard_keys: str = ""
    who: str = ""
    wait: float = 2.0
    run: str = ""
    stop_robots: bool = False
    issued: float = 0.0


Answer = transaction.Applied


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Applies a release as one transaction. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request.swarm)
    previous = request.previous
    values, archive = _parts(request, payload)
    change = Change(
        txid=release_name(request.txid),
        who=lock.operator_in(request),
        run=str(request.run),
        previous=None if previous is None else release_name(previous),
        next=release_name(request.next),
        steps=steps.taken(request.steps),
        confirm_within=min(float(request.confirm_within), 3600.0),
        values=secrets.offered(values),
        stop_robots=bool(request.stop_robots),
        files_only=bool(request.files_only),
        issued=float(request.issued),
    )
    if not systemd.present(home):
        raise RefusedError("this host does not run systemd", "swarmctl needs a host that boots with systemd")
    with lease.held_for(home, request):
        passed("lock")
        known_keys.learn(home, str(request.wireguard_keys))
        return transaction.run(home, change, archive, report)


def interrupted(request: Request, received: bytes) -> None:
    """Keeps the files of an upload that ended early, if this run still has the lease."""
    home = home_of(request.swarm)
    with suppress(RefusedError, OSError), lease.held_for(home, request):
        upload.keep(home, release_name(request.next), _parts(request, received)[1])


def _parts(request: Request, payload: bytes) -> tuple[bytes, bytes]:
    """The secrets and the archive in a payload."""
    size = max(0, int(request.secrets))
    return payload[:size], payload[size:]
