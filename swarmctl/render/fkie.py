"""Several masters, joined by fkie's discovery and sync: their parameters, their launch file.

What crosses is said at the hub that hears it: which topics, each from its own master only, and publishers
only. So nothing crosses that the spec does not name, and nothing runs against its direction.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from swarmctl.render.bundle import ROOT, File, package
from swarmctl.render.params import params_file
from swarmctl.render.templates import render
from swarmctl.topology.fkie import FAMILIES, Node
from swarmctl.topology.ports import discovery_port
from swarmctl.topology.swarm import Host, Island, Swarm

PARAMS = "params/multimaster.yaml"
LAUNCH = "launch/multimaster.launch"

# A master is offline once it has been silent for 5 s x 2 (5 beats x 2 below 1 Hz); fkie's own factor is 10.
# Sync then registers everything anew when it is back, since rospy joins no connection again that it lost
# (fkie/multimaster_fkie#173).
_PATIENCE = {"measurement_intervals": 5, "timeout_factor": 2}
_RECONNECT = {"resync_on_reconnect": True, "resync_on_reconnect_timeout": 0}


def files(swarm: Swarm, island: Island) -> tuple[File, ...]:
    """The parameters and the launch file of the hub of ``island``."""
    nodes = _nodes(swarm, island)
    params = {node.name: values for node, values in nodes.items()}
    launch = render("multimaster.launch", params=f"{ROOT}/{swarm.name}/current/{PARAMS}", nodes=list(nodes))
    return (
        File(PARAMS, params_file(params), origin="multimaster"),
        File(LAUNCH, launch, origin="multimaster"),
    )


def command(swarm: Swarm) -> tuple[str, ...]:
    """Both nodes, under the master that is there: without `--wait` roslaunch may start one of its own."""
    return ("roslaunch", "--wait", "--skip-log-check", f"{ROOT}/{swarm.name}/current/{LAUNCH}")


def requires(swarm: Swarm, island: Island) -> tuple[str, ...]:
    return tuple(package(node.package) for node in _nodes(swarm, island))


def _nodes(swarm: Swarm, island: Island) -> Mapping[Node, Mapping[str, Any]]:
    """The nodes beside a master with their parameters. Where nothing is to be heard, sync stays away:

    told of no topic, it lets all of them in.
    """
    family = FAMILIES[swarm.multimaster.packages]
    heard = _heard(swarm, island)
    nodes: dict[Node, Mapping[str, Any]] = {family.discovery: discovery(swarm, island)}
    return nodes | {family.sync: sync(swarm, heard)} if heard else nodes


def discovery(swarm: Swarm, island: Island) -> Mapping[str, Any]:
    """How the master of ``island`` tells the others that it is there."""
    settings = swarm.multimaster
    others = [other.hub for other in swarm.islands if other is not island]
    multicast = any(one.multicast is not False for one in swarm.networks if island.hub in one.hosts)
    return {
        "name": island.hub,
        "mcast_group": settings.group,
        "mcast_port": settings.port,
        "send_mcast": multicast,
        "listen_mcast": multicast,
        "robot_hosts": [swarm.hosts[hub].address for hub in settings.robot_hosts.get(island.hub, others)],
        **_interface(swarm.hosts[island.hub]),
        "rpc_port": discovery_port(island),
        "rosmaster_hz": 1.0,
        "heartbeat_hz": settings.heartbeat_hz,
        **_PATIENCE,
        "active_request_after": settings.active_request_after,
        "remove_after": settings.remove_after,
    }


def _interface(hub: Host) -> Mapping[str, Any]:
    """Where to send and listen: fkie asks ROS_IP, and at home a host's own name may mean 127.0.1.1."""
    return {"interface": hub.address} if hub.advertised != hub.address else {}


def sync(swarm: Swarm, heard: Mapping[str, list[str]]) -> Mapping[str, Any]:
    """What a master takes over from the others: by hub, the topics ``heard`` here.

    Masters that are not named stay out by `sync_hosts`; beside it, `ignore_hosts` would let them in again.
    """
    several = any(len(other.hosts) > 1 for other in swarm.islands if other.hub in heard)
    return {
        "sync_hosts": list(heard),
        "sync_topics": [{hub: topics} for hub, topics in heard.items()],
        "ignore_subscribers": ["*"],
        "ignore_services": ["*"],
        "sync_remote_nodes": several,
        "sync_topics_on_demand": False,
        **_RECONNECT,
    }


def _heard(swarm: Swarm, island: Island) -> dict[str, list[str]]:
    """By hub of origin, the topics that cross to ``island``."""
    hubs = {other.name: other.hub for other in swarm.islands}
    heard = swarm.heard.get(island.name, {})
    return {hubs[origin]: list(topics) for origin, topics in heard.items()}
