"""``motion``: which robots of the host are in use, after stopping them if the request says so."""

from __future__ import annotations

from swarm_onboard.agent import motion_gate, stop_latches
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.motion_messages import MotionAnswer, MotionRequest


def handle(request: MotionRequest, payload: bytes, report: Report) -> MotionAnswer:
    """Returns who is in use. Raises ``RefusedError`` for a robot that does not stop."""
    home = home_of(request["swarm"])
    robots = stop_latches.robot_names(request["robots"])
    if home.current() is None:
        return {"in_use": {}}
    if request["stop"]:
        motion_gate.halt(home, robots, str(request["who"])[:200], report.note)
    return {"in_use": motion_gate.in_use(home, robots)}
