"""``restart``: restart the units of robots. A robot in use is not touched."""

from __future__ import annotations

from swarm_onboard.agent import lease, lock, motion_gate, stop_latches, systemd, unit_start
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

_PATIENCE = 180.0  # s


class Request(NamedTuple):
    """Restart the units of ``robots``, with ``others`` of all robots here."""

    swarm: str
    robots: list[str]
    others: bool
    who: str = ""
    wait: float = 2.0
    run: str = ""
    stop_robots: bool = False


class Answer(NamedTuple):
    """``restarted``: the units, which run again."""

    deployed: bool
    restarted: list[str]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Restarts units and waits until they run. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request.swarm)
    robots = stop_latches.robot_names(request.robots)
    if home.current() is None:
        return Answer(False, [])
    with lease.held_for(home, request):
        units = _units_of(home, robots, others=request.others)
        who = lock.operator_in(request)
        motion_gate.clear(home, units, stop=bool(request.stop_robots), who=who, note=report.note)
        report.detach()
        if units:
            systemd.call(["systemctl", "reset-failed", "--", *units], 20)
            systemd.call(["systemctl", "restart", "--", *units], _PATIENCE)  # by systemd, if the agent ends
            unit_start.start(units)
    return Answer(True, units)


def _units_of(home: Home, robots: list[str], *, others: bool) -> list[str]:
    """The units of these robots, with ``others`` of all; in the order in which they start."""
    found = home.units(home.current())
    return [unit["name"] for unit in found if unit["robot"] in robots or (others and unit["robot"])]
