"""``recording``: how the recording of this host is doing, which it may stop, and its bags."""

from __future__ import annotations

from swarm_onboard.agent import bags
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """How the recording is doing; ``stop`` ends it before."""

    swarm: str
    stop: bool = False


Answer = bags.Recording


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the state. Raises ``FailedError`` if the recording does not end."""
    home = home_of(request.swarm)
    if request.stop:
        report.detach()
        bags.stop(home)
    return bags.state(home)
