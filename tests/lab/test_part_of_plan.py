"""``lab up --only``: some hosts, their networks, robots and masters."""

from __future__ import annotations

from pathlib import Path

from swarmctl.lab.lab_plan import masters_for, part_of, plan_of
from swarmctl.swarm.resolved import Swarm
from tests.loading import load_swarm


def swarm_of(leader_spec: Path) -> Swarm:
    swarm, found = load_swarm(leader_spec)
    assert swarm is not None, found
    return swarm


def test_the_master_of_a_host_is_needed(leader_spec: Path) -> None:
    swarm = swarm_of(leader_spec)
    assert masters_for(swarm, ["k3-pi"]) == {"koala-laptop": ("k3-pi",)}
    assert masters_for(swarm, ["koala-laptop", "k3-pi"]) == {}


def test_a_part_has_only_its_hosts_and_their_robots(leader_spec: Path) -> None:
    whole = plan_of(swarm_of(leader_spec))
    part = part_of(whole, ["k3-pi"])
    assert [host.name for host in part.hosts] == ["k3-pi"]
    assert [robot.name for robot in part.robots] == ["k3"]
    assert part.hosts[0] in whole.hosts
    assert {one.name for one in part.networks} == {one.network for one in part.hosts[0].interfaces}
