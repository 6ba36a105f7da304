"""``undo``: a change that is pending, or that a dead agent has left, is undone now."""

from __future__ import annotations

from swarm_onboard.agent import lock, record, rollback, transaction
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.record import Record
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.messages import ConfirmAnswer, ConfirmRequest


def handle(request: ConfirmRequest, payload: bytes, report: Report) -> ConfirmAnswer:
    """Undoes a change. Raises ``RefusedError`` for another one, or for one that was confirmed.

    Without ``pending`` only what a dead agent has left is undone: a change that was decided in the meantime
    needs nothing.
    """
    home = home_of(request["swarm"])
    txid = release_name(request["txid"])
    with lock.held_for(home, request):
        found = record.read(home)
        pending = request.get("pending", True)
        decided = found.txid != txid or found.state == record.APPLIED
        if decided and pending:
            raise RefusedError(
                "that deploy cannot be undone any more: {}".format(
                    "it was confirmed" if found.txid == txid else "another one followed"
                ),
                "`swarmctl plan` shows the result",
            )
        if found.left(home) and not pending:
            raise transaction.waiting(home, found)
        if found.open and not decided:
            report.detach()
            report.note(
                f"going back to release {found.previous}" if found.previous else "going back to nothing"
            )
            rollback.undo(home, found, _cause(home, found, lock.operator_in(request)))
        return {"release": home.current()}


def _cause(home: Home, found: Record, who: str) -> str:
    return f"undone by {who}" if found.left(home) else rollback.cause(home, found)
