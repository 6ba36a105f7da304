"""``undo``: a change that is pending, or that a dead agent has left, is undone now."""

from __future__ import annotations

from swarm_onboard.agent import lock, record, rollback, transaction
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.record import Record
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """The change ``txid``, which is pending or was interrupted, is undone.

    ``pending``: false if it was not pending when the operator looked; then it is not undone if it is now.
    """

    swarm: str
    txid: str
    pending: bool = True
    who: str = ""
    wait: float = 2.0


class Answer(NamedTuple):
    """The current release; null: none."""

    release: str | None


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Undoes a change. Raises ``RefusedError`` for another one, or for one that was confirmed.

    Without ``pending`` only what a dead agent has left is undone: a change that was decided in the meantime
    needs nothing.
    """
    home = home_of(request.swarm)
    txid = release_name(request.txid)
    with lock.held_for(home, request):
        found = record.read(home)
        decided = found.txid != txid or found.state == record.APPLIED
        if decided and request.pending:
            raise RefusedError(
                "that deploy cannot be undone any more: {}".format(
                    "it was confirmed" if found.txid == txid else "another one followed"
                ),
                "`swarmctl plan` shows the result",
            )
        if found.left(home) and not request.pending:
            raise transaction.waiting(home, found)
        if found.open and not decided:
            report.detach()
            report.note(
                f"going back to release {found.previous}" if found.previous else "going back to nothing"
            )
            rollback.undo(home, found, _cause(home, found, lock.operator_in(request)))
        return Answer(home.current())


def _cause(home: Home, found: Record, who: str) -> str:
    return f"undone by {who}" if found.left(home) else rollback.cause(home, found)
