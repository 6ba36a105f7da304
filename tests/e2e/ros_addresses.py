"""The addresses that ROS uses in a lab, those of WireGuard if the swarm is sealed."""

from __future__ import annotations

from collections.abc import Mapping

from tests.e2e.lab_swarm import LabSwarm
from tests.loading import load_swarm


def ros_addresses(swarm: LabSwarm) -> Mapping[str, str]:
    """By host, of the spec that is deployed."""
    found, _ = load_swarm(swarm.deployed or swarm.spec)
    assert found is not None
    return {host.name: host.ros_address for host in found.hosts.values()}
