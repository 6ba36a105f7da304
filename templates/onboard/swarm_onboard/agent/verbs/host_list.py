"""``host_list``: the hosts of the swarm, as this host has stored them; a newer list takes its place."""

from __future__ import annotations

from swarm_onboard.agent import audit, host_list, lease, lock, record, secrets
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.record import Record
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Mapping, Sequence


class Request(NamedTuple):
    """The hosts of the swarm, as this host has stored them. With ``hosts`` this list takes its place if its
    ``epoch`` is larger; ``forgotten``: hosts that ``who`` left out of it, logged as the run ``txid``.
    """

    swarm: str
    hosts: Mapping[str, Any] | None = None
    gone: Mapping[str, int] | None = None
    epoch: int = 0
    forgotten: Sequence[str] = ()
    txid: str = ""
    who: str = ""
    wait: float = 2.0
    run: str = ""


Answer = host_list.HostList


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the list. Raises ``RefusedError`` while another run changes the host."""
    home = home_of(request.swarm)
    if request.hosts is not None and home.current() is not None:
        with lease.held_for(home, request):
            written = host_list.write(home, int(request.epoch), request.hosts, request.gone or {})
            if written and request.forgotten:
                _note(home, request)
    return host_list.read(home)


def _note(home: Home, request: Request) -> None:
    """Logs which hosts were forgotten, as a change that leaves this host as it is."""
    now, values = home.current(), secrets.current(home)
    done = Record(
        state=record.FORGOTTEN,
        txid=release_name(request.txid),
        who=lock.operator_in(request),
        run=release_name(request.txid),
        previous=now,
        next=now,
        previous_secrets=values,
        next_secrets=values,
        error=", ".join(map(str, request.forgotten))[:2000],
    )
    audit.note(home, done)
