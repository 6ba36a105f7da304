"""``start``: release robots that ``stop`` has latched. They stand until the next command."""

from __future__ import annotations

from swarm_onboard.agent import robot_motion, stop_latches
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
    released = stop_latches.release(home, robots)
    running = robot_motion.sockets(home)
    robot_motion.ask({one: running[one] for one in released if one in running})
    return Answer(home.current() is not None, released)
