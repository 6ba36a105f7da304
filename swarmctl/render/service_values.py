"""What all units of a host share, whatever its ROS, and the terms of `maintenance` that its agent reads."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from swarm_onboard.agent.motion_gate import TERMS_FILE

from swarmctl.render.bundle import ROOT, File, Part
from swarmctl.render.security_level import level_of
from swarmctl.swarm import names
from swarmctl.swarm.addresses import is_ipv6
from swarmctl.swarm.flow import Service
from swarmctl.swarm.resolved import Host, Island, Swarm


def maintenance_part(swarm: Swarm, host: Host) -> Part:
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


DDS_GROUP = "239.255.0.1"  # OMG DDSI-RTPS 2.5, 9.6.1.4.1
#: Over IPv6 each implementation has a group of its own: Fast DDS 2.6 to 3.2, Cyclone DDS 0.10.
_IPV6_GROUPS = {"fastrtps": "ff1e::ffff:efff:1", "cyclonedds": "ff02::ffff:efff:1"}


def service_values(swarm: Swarm, host: Host, *, master: bool = True) -> dict[str, Any]:
    """Returns the template values that all units of this host share; ``master``: its ROS has one."""
    return {
        "swarm": swarm.name,
        "home": home(swarm),
        "target": names.target(swarm.name),
        "workspaces": host.workspaces,
        "master": master,
        "reachable": level_of(swarm.island_of(host.name).security).reachable(swarm, host),
        "enclave": "",
    }


def robots_with_nodes(swarm: Swarm, island: Island) -> Iterator[str]:
    """Yields the addresses of the robots of ``island`` that run nodes themselves."""
    for host in island.hosts:
        yield from (one.node_address for one in swarm.robots_on(host) if one.node_address)


def toward_robots(swarm: Swarm, host: Host) -> tuple[str, ...]:
    """Returns the other addresses at which robots of ``host`` that run nodes themselves reach it."""
    found = (robot.host_address for robot in swarm.robots_on(host.name))
    return tuple(dict.fromkeys(one for one in found if one and one != host.ros_address))


def groups(swarm: Swarm, island: Island) -> Iterator[str]:
    """Yields the multicast group in which hosts of ``island`` discover others, if any."""
    if not island.has_master:
        if island.discovery.method == "multicast":
            ipv6 = is_ipv6(swarm.hosts[island.hub].ros_address)
            yield _IPV6_GROUPS[island.discovery.rmw] if ipv6 else DDS_GROUP
    elif any(flow.service is Service.MULTIMASTER and island.hub in flow.hosts for flow in swarm.flows):
        yield swarm.multimaster.group


def home(swarm: Swarm) -> str:
    """Returns the swarm's folder on every host."""
    return f"{ROOT}/{swarm.name}"
