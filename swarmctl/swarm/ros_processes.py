"""How many processes with ROS nodes each host runs. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from swarmctl.swarm.index import SwarmIndex


def ros_processes(index: SwarmIndex) -> Mapping[str, int]:
    """Returns, by host, the number of its drivers, of gates in front of ROS packages, and of programs."""
    driving = index.driving
    gates = (driving[name] for name in index.gated)
    placed = (*driving.values(), *gates, *index.program_hosts.values())
    return Counter(host for host in placed if host is not None)
