"""``history``: the last changes of the host."""

from __future__ import annotations

from swarm_onboard.agent import audit, record, secrets, way_back
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.history_messages import HistoryAnswer, HistoryRequest


def handle(request: HistoryRequest, payload: bytes, report: Report) -> HistoryAnswer:
    """Returns the changes, the oldest first, and the releases that the host still has."""
    home = home_of(request["swarm"])
    answer: HistoryAnswer = {
        "entries": audit.entries(home),
        "release": home.current(),
        "secrets": secrets.current(home),
        "releases": home.releases(),
        "secret_sets": secrets.sets(home),
        "last": record.read(home).txid,
    }
    if to := request.get("to"):
        answer["units"] = way_back.units(home, to[0], to[1])
    return answer
