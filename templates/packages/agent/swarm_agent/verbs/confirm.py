"""``confirm``: the pending change of a host stays."""

from __future__ import annotations

from swarm_agent import lock, transaction
from swarm_agent.failpoint import passed
from swarm_agent.manifest import release_name
from swarm_agent.release_store import home_of
from swarm_agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_agent.messages import ConfirmAnswer, ConfirmRequest


def handle(request: ConfirmRequest, payload: bytes, report: Report) -> ConfirmAnswer:
    """Confirms a change. Raises ``RefusedError`` for another one, ``FailedError`` if it was undone."""
    home = home_of(request["swarm"])
    txid = release_name(request["txid"])
    with lock.held_for(home, request):
        passed("lock")
        report.detach()
        return transaction.confirm(home, txid)
