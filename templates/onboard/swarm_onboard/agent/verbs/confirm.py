"""``confirm``: the pending change of a host stays."""

from __future__ import annotations

from swarm_onboard.agent import lock, transaction
from swarm_onboard.agent.failpoint import passed
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """The pending change ``txid`` stays."""

    swarm: str
    txid: str
    who: str = ""
    wait: float = 2.0


class Answer(NamedTuple):
    """The current release."""

    release: str


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Confirms a change. Raises ``RefusedError`` for another one, ``FailedError`` if it was undone."""
    home = home_of(request.swarm)
    txid = release_name(request.txid)
    with lock.held_for(home, request):
        passed("lock")
        report.detach()
        return Answer(transaction.confirm(home, txid))
