"""``start``: release robots that ``stop`` has latched. They stand until the next command."""

from __future__ import annotations

from swarm_onboard.agent import robot_motion, stop_latches, trial_guard
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """Release ``robots``, with ``others`` all that are latched here."""

    swarm: str
    robots: list[str]
    others: bool


class Answer(NamedTuple):
    """``released``: the robots that were latched."""

    deployed: bool
    released: list[str]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Releases robots and wakes their drivers."""
    home = home_of(request.swarm)
    robots = stop_latches.robot_names(request.robots)
    if request.others:
        robots = list(dict.fromkeys([*robots, *stop_latches.closed(home)]))
    trial_guard.leave(home, robots)
    released = stop_latches.release(home, robots)
    robot_motion.wake(home, released)
    return Answer(home.current() is not None, released)
