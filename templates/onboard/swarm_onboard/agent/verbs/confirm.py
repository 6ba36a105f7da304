"""``confirm``: the pending change of a host stays."""

from __future__ import annotations

from swarm_onboard.agent import lock, transaction
from swarm_onboard.agent.failpoint import passed
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.messages import ConfirmAnswer, ConfirmRequest


def handle(request: ConfirmRequest, payload: bytes, report: Report) -> ConfirmAnswer:
    """Confirms a change. Raises ``RefusedError`` for another one, ``FailedError`` if it was undone."""
    home = home_of(request["swarm"])
    txid = release_name(request["txid"])
    with lock.held_for(home, request):
        passed("lock")
        report.detach()
        return transaction.confirm(home, txid)
