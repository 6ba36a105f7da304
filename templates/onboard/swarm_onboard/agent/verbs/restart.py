"""``restart``: restart the units of robots. A robot in use is not touched."""

from __future__ import annotations

from swarm_onboard.agent import lease, lock, motion_gate, stop_latches, systemd, unit_start
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.motion_messages import RestartAnswer, RestartRequest

_PATIENCE = 180.0  # s


def handle(request: RestartRequest, payload: bytes, report: Report) -> RestartAnswer:
    """Restarts units and waits until they run. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request["swarm"])
    robots = stop_latches.robot_names(request["robots"])
    if home.current() is None:
        return {"deployed": False, "restarted": []}
    with lease.held_for(home, request):
        units = _units_of(home, robots, others=request["others"])
        who = lock.operator_in(request)
        motion_gate.clear(home, units, stop=bool(request.get("stop_robots")), who=who, note=report.note)
        report.detach()
        if units:
            systemd.call(["systemctl", "reset-failed", "--", *units], 20)
            systemd.call(["systemctl", "restart", "--", *units], _PATIENCE)  # by systemd, if the agent ends
            unit_start.start(units)
    return {"deployed": True, "restarted": units}


def _units_of(home: Home, robots: list[str], *, others: bool) -> list[str]:
    """The units of these robots, with ``others`` of all; in the order in which they start."""
    found = home.units(home.current())
    return [unit["name"] for unit in found if unit["robot"] in robots or (others and unit["robot"])]
