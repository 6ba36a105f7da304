"""``recording``: how the recording of this host is doing, which it may stop, and its bags."""

from __future__ import annotations

from swarm_onboard.agent import bags
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.recording_messages import RecordingAnswer, RecordingRequest


def handle(request: RecordingRequest, payload: bytes, report: Report) -> RecordingAnswer:
    """Returns the state. Raises ``FailedError`` if the recording does not end."""
    home = home_of(request["swarm"])
    if request["stop"]:
        report.detach()
        bags.stop(home)
    return bags.state(home)
