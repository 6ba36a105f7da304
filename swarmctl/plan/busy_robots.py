"""Robots that a plan would touch while they are in use, or their terms of maintenance do not hold. Pure."""

from __future__ import annotations

from dataclasses import replace

from swarm_onboard.agent.motion_gate import hint
from swarm_onboard.agent.steps import Kind

from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.render.bundle import Bundle

BUSY = "busy"
_TOUCHING = (Kind.STOP, Kind.RESTART)


def not_busy(plan: HostPlan, bundle: Bundle, observed: Observed) -> HostPlan:
    """Returns the plan, with a problem if it would touch a robot that must not be touched now."""
    robots = {unit.name: unit.robot for unit in bundle.units}
    if observed.manifest is not None:
        robots |= {unit["name"]: unit.get("robot", "") for unit in observed.manifest["units"]}
    touched = {robots.get(unit, "") for unit in plan.targets(*_TOUCHING)}
    found = [f"{robot} {why}" for robot, why in observed.busy.items() if robot in touched]
    text = "; ".join(found)
    return replace(plan, problem=Problem(BUSY, text, hint(text))) if found else plan
