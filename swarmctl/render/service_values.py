"""What all units of a host share, whatever its ROS."""

from __future__ import annotations

from typing import Any

from swarmctl.render.bundle import ROOT
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Swarm


def service_values(swarm: Swarm, host: Host, *, master: bool = True) -> dict[str, Any]:
    """Returns the template values that all units of this host share; ``master``: its ROS has one."""
    return {
        "swarm": swarm.name,
        "home": home(swarm),
        "target": names.target(swarm.name),
        "workspaces": host.workspaces,
        "master": master,
    }


def home(swarm: Swarm) -> str:
    """Returns the swarm's folder on every host."""
    return f"{ROOT}/{swarm.name}"
