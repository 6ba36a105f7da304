"""``hold``: wait until the units of a pending change keep running; undo it if they do not."""

from __future__ import annotations

from swarm_onboard.agent import lock, record, rollback, systemd, unit_start
from swarm_onboard.agent.errors import FailedError, RefusedError
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.record import Record
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

_LONGEST = 600.0  # s


class Request(NamedTuple):
    """Wait until the units of the pending change ``txid`` have run for ``seconds`` without a restart, at most
    ``within`` s. If they do not, or its agent has died, the change is undone."""

    swarm: str
    txid: str
    seconds: float
    within: float
    who: str = ""
    wait: float = 2.0


class Answer(NamedTuple):
    """The states of the units of the release."""

    units: dict[str, systemd.UnitState]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the states of the units. Raises ``FailedError`` if the change is undone, or was before."""
    home = home_of(request.swarm)
    txid = release_name(request.txid)
    seconds, within = (min(max(value, 0.0), _LONGEST) for value in (request.seconds, request.within))
    with lock.held_for(home, request):  # an agent whose connection was lost may still be at work
        found = _undone_without(home, txid, "", report)
    units = [unit for unit in home.manifest(found.next).units if unit in (*found.touched, *found.reloaded)]
    if trouble := unit_start.not_steady(units, seconds, within):
        with lock.held_for(home, request):
            found = _undone_without(home, txid, trouble, report)
    return Answer(systemd.states(home.manifest(found.next).units))


def _undone_without(home: Home, txid: str, trouble: str, report: Report) -> Record:
    """Returns the record if the change is pending without ``trouble``, or confirmed; undoes an open one."""
    found = record.read(home)
    if found.txid != txid:
        raise RefusedError("another deploy followed", "`swarmctl plan` shows the result")
    if found.state == record.APPLIED or (found.left(home) and not trouble):
        return found
    if not found.open:
        raise FailedError(found.error)
    because = trouble or rollback.cause(home, found)
    report.detach()
    report.note(f"undoing: {because}")
    raise rollback.undo(home, found, because)
