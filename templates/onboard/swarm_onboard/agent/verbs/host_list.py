"""``host_list``: the hosts of the swarm, as this host has stored them; a newer list takes its place."""

from __future__ import annotations

from swarm_onboard.agent import audit, host_list, lease, lock, record, secrets
from swarm_onboard.agent.manifest import release_name
from swarm_onboard.agent.record import Record
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.host_list_messages import HostListAnswer, HostListRequest


def handle(request: HostListRequest, payload: bytes, report: Report) -> HostListAnswer:
    """Returns the list. Raises ``RefusedError`` while another run changes the host."""
    home = home_of(request["swarm"])
    if "hosts" in request and home.current() is not None:
        with lease.held_for(home, {"who": request.get("who", ""), "wait": request.get("wait", 2)}):
            written = host_list.write(home, int(request["epoch"]), request["hosts"], request.get("gone", {}))
            if written and request.get("forgotten"):
                _note(home, request)
    return host_list.read(home)


def _note(home: Home, request: HostListRequest) -> None:
    """Logs which hosts were forgotten, as a change that leaves this host as it is."""
    now, values = home.current(), secrets.current(home)
    done = Record(
        state=record.FORGOTTEN,
        txid=release_name(request["txid"]),
        who=lock.operator_in({"who": request.get("who", "")}),
        run=release_name(request["txid"]),
        previous=now,
        next=now,
        previous_secrets=values,
        next_secrets=values,
        error=", ".join(map(str, request["forgotten"]))[:2000],
    )
    audit.note(home, done)
