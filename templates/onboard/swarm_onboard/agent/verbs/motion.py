"""``motion``: which robots of the host are in use, after stopping them if the request says so."""

from __future__ import annotations

from swarm_onboard.agent import motion_gate, stop_latches
from swarm_onboard.agent.motion_gate import RobotUse
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """Which of ``robots`` are in use; with ``stop`` they are latched first and must be confirmed to stand."""

    swarm: str
    who: str
    robots: list[str]
    stop: bool


class Answer(NamedTuple):
    """``in_use``: the robots that move or are under command, and are not stopped; by robot."""

    in_use: dict[str, RobotUse]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns who is in use. Raises ``RefusedError`` for a robot that does not stop."""
    home = home_of(request.swarm)
    robots = stop_latches.robot_names(request.robots)
    if home.current() is None:
        return Answer({})
    if request.stop:
        motion_gate.halt(home, robots, str(request.who)[:200], report.note)
    return Answer(motion_gate.in_use(home, robots))
