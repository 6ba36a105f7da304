"""A part of a lab: some of its hosts, with the networks and robots that they need."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from swarmctl.lab.lab_plan import LabPlan
from swarmctl.swarm.resolved import Swarm


def masters_for(swarm: Swarm, hosts: Collection[str]) -> Mapping[str, tuple[str, ...]]:
    """Returns the hosts outside of ``hosts`` that run their masters, each with the hosts that need it."""
    needed = {
        island.hub: tuple(host for host in island.hosts if host in hosts)
        for island in swarm.islands
        if island.hub not in hosts
    }
    return {hub: members for hub, members in needed.items() if members}


def part_of(plan: LabPlan, hosts: Collection[str]) -> LabPlan:
    """Returns the plan with only these hosts. Addresses are those of the whole lab."""
    kept = tuple(host for host in plan.hosts if host.name in hosts)
    networks = {one.network for host in kept for one in host.interfaces}
    return replace(
        plan,
        hosts=kept,
        networks=tuple(one for one in plan.networks if one.name in networks),
        robots=tuple(robot for robot in plan.robots if robot.host in hosts),
        stand_ins=tuple(one for one in plan.stand_ins if one.host in hosts),
    )
