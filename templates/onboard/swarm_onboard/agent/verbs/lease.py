"""``lease``: the lease of the swarm on this host, for one run of swarmctl."""

from __future__ import annotations

from swarm_onboard.agent import boot, lease, lock, record
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.messages import LeaseAnswer, LeaseRequest


def handle(request: LeaseRequest, payload: bytes, report: Report) -> LeaseAnswer:
    """Gives the lease, renews it or takes it back. Raises ``RefusedError`` while the host is locked."""
    home = home_of(request["swarm"])
    run = release_name(request["run"])
    with lock.held_for(home, request):
        if request["want"]:
            found = lease.ask(home, run, lock.operator_in(request), request.get("breaks", ""))
            if found.run == run and "pending" in request:
                _extend(home, request["pending"], float(request.get("confirm_within", 0)))
        else:
            found = lease.give_back(home, run)
        last = record.read(home)
        return {
            "granted": found.run == run,
            "epoch": found.epoch,
            "run": found.run,
            "who": found.who,
            "left": round(found.left(home), 1),
            "last": last.txid,
            "last_who": last.who,
        }


def _extend(home: Home, txid: str, seconds: float) -> None:
    """Moves the deadline of the change ``txid``, if it is still pending."""
    found = record.read(home)
    if found.txid == txid and found.left(home):
        record.write(home, found._replace(deadline=boot.now() + min(seconds, 3600.0)))
