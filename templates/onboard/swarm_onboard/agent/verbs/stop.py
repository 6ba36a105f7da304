"""``stop``: latch robots so that they stand, and show from their wheels that they do.

Takes no lock: it is done while a deploy runs, too.
"""

from __future__ import annotations

import time

from swarm_onboard.agent import robot_motion, stop_latches
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.robot_motion import RobotMotion
from swarm_onboard.agent.rpc import Report

_LONGEST = 10.0  # s
UNGUARDED = "neither a driver of swarmctl nor a gate is deployed for it here: nothing stops its wheels"


class Request(NamedTuple):
    """Latch ``robots`` so that they stand; with ``others`` those too that run here and are not named.

    ``patience``: s to wait until their wheels are confirmed to stand.
    """

    swarm: str
    who: str
    robots: list[str]
    others: bool
    patience: float


class Answer(NamedTuple):
    """``deployed``: the swarm is on the host; ``elapsed``: s that the request took on the host."""

    deployed: bool
    elapsed: float
    robots: dict[str, RobotMotion]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Latches robots, wakes their drivers and gates, and waits for what shows that the robots stand."""
    began = time.monotonic()
    home = home_of(request.swarm)
    named = stop_latches.robot_names(request.robots)
    if home.current() is None:
        return Answer(False, 0.0, {})
    running = robot_motion.sockets(home)
    robots = list(dict.fromkeys([*named, *(running if request.others else ())]))
    trouble = {one: UNGUARDED for one in robots if one not in running and not robot_motion.guarded(home, one)}
    latch = stop_latches.Latch(str(request.who)[:200], round(time.time(), 3))
    trouble.update(stop_latches.close(home, [one for one in robots if one not in trouble], latch))
    latched = [one for one in robots if one not in trouble]
    queried = {one: running[one] for one in latched if one in running}
    answers = robot_motion.ask(
        queried, min(float(request.patience), _LONGEST), lambda found: robot_motion.proven(found, queried)
    )
    stop_latches.sync(home, latched)
    found: dict[str, RobotMotion] = {}
    for one in robots:
        motion = robot_motion.motion(answers.get(one), began, latched=one in latched)
        found[one] = motion._replace(trouble=trouble.get(one, motion.trouble))
    return Answer(True, round(time.monotonic() - began, 3), found)
