"""``history``: the last changes of the host."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarm_agent import audit, record
from swarm_agent.release_store import home_of
from swarm_agent.rpc import Report

if TYPE_CHECKING:
    from swarm_agent.history_messages import HistoryAnswer, HistoryRequest


def handle(request: HistoryRequest, payload: bytes, report: Report) -> HistoryAnswer:
    """Returns the changes, the oldest first, and the releases that the host still has."""
    home = home_of(request["swarm"])
    return {
        "entries": audit.entries(home),
        "release": home.current(),
        "releases": home.releases(),
        "last": record.read(home).txid,
    }
