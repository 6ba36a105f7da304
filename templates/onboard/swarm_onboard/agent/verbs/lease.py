"""``lease``: the lease of the swarm on this host, for one run of swarmctl."""

from __future__ import annotations

from swarm_onboard.agent import boot, lease, lock, record
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """Give or renew the lease of the swarm on this host to ``run``, or with ``want`` false take it back.

    ``breaks``: a run that has ended, whose lease does not count; ``pending``: the change of this run that
    waits, and has ``confirm_within`` s from now.
    """

    swarm: str
    run: str
    want: bool
    breaks: str = ""
    pending: str = ""
    confirm_within: float = 0.0
    who: str = ""
    wait: float = 2.0


class Answer(NamedTuple):
    """``granted``: ``run`` has the lease; if not, the run and the operator that have it, for ``left`` s;
    ``last``: the last transaction of the host, which ``last_who`` began."""

    granted: bool
    epoch: int
    run: str
    who: str
    left: float
    last: str
    last_who: str


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Gives the lease, renews it or takes it back. Raises ``RefusedError`` while the host is locked."""
    home = home_of(request.swarm)
    run = release_name(request.run)
    with lock.held_for(home, request):
        if request.want:
            found = lease.ask(home, run, lock.operator_in(request), request.breaks)
            if found.run == run and request.pending:
                _extend(home, request.pending, float(request.confirm_within))
        else:
            found = lease.give_back(home, run)
        last = record.read(home)
        left = round(found.left(home), 1)
        return Answer(found.run == run, found.epoch, found.run, found.who, left, last.txid, last.who)


def _extend(home: Home, txid: str, seconds: float) -> None:
    """Moves the deadline of the change ``txid``, if it is still pending."""
    found = record.read(home)
    if found.txid == txid and found.left(home):
        record.write(home, found._replace(deadline=boot.now() + min(seconds, 3600.0)))
