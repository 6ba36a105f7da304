"""The terms of `maintenance` for the robots of one host, as its agent reads them."""

from __future__ import annotations

import json

from swarm_onboard.agent.motion_gate import TERMS_FILE

from swarmctl.render.bundle import File, Part
from swarmctl.swarm.resolved import Host, Swarm


def part(swarm: Swarm, host: Host) -> Part:
    """Returns the file with the terms; no file where none is set. No unit reads it, so none restarts."""
    terms = {
        one.name: {
            "idle": one.maintenance.idle or 0.0,
            "battery": one.maintenance.battery or 0.0,
            **({"docked": True} if one.maintenance.docked else {}),
        }
        for one in swarm.robots_on(host.name)
        if one.maintenance.model_fields_set
    }
    if not terms:
        return Part()
    content = json.dumps(terms, sort_keys=True, indent=1) + "\n"
    return Part(files=(File(TERMS_FILE, content.encode(), origin="maintenance"),))
