"""Provider `fkie`: masters joined by the discovery and sync nodes of fkie's packages.

They are fixed: each sync node leaves out other masters' discovery and sync nodes by these names.

The hub that receives topics lists them: each from its own master, publishers only. So nothing is bridged
that the spec does not name, and nothing against its direction.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.render.bundle import ROOT, File, Part, Unit, package
from swarmctl.render.middleware import Capability
from swarmctl.render.multimaster import Discovery, JoinNodes, MultimasterProvider
from swarmctl.render.quoting import render
from swarmctl.render.ros1 import release
from swarmctl.render.security_level import level_of
from swarmctl.render.service_values import service_values
from swarmctl.render.yaml_params import params_file
from swarmctl.spec.model import Spec
from swarmctl.spec.ros_model import Multimaster
from swarmctl.swarm import names
from swarmctl.swarm.ports import USUAL_MASTER, Listener, PortRange, master_loc
from swarmctl.swarm.resolved import Host, Island, Swarm


@dataclass(frozen=True)
class Node:
    """A node of one of the packages: what roslaunch starts, and under which name."""

    package: str
    executable: str
    name: str


@dataclass(frozen=True)
class Family:
    """The two nodes of one generation of packages."""

    discovery: Node
    sync: Node


#: By ``multimaster.packages``, which names the metapackage.
FAMILIES: Mapping[str, Family] = {
    "fkie_multimaster": Family(
        Node("fkie_master_discovery", "master_discovery", "master_discovery"),
        Node("fkie_master_sync", "master_sync", "master_sync"),
    ),
    "multimaster_fkie": Family(
        Node("master_discovery_fkie", "master_discovery", "master_discovery"),
        Node("master_sync_fkie", "master_sync", "master_sync"),
    ),
    "fkie_mas": Family(
        Node("fkie_mas_discovery", "mas-discovery", "mas_discovery"),
        Node("fkie_mas_sync", "mas-sync", "mas_sync"),
    ),
}


PARAMS = "params/multimaster.yaml"
LAUNCH = "launch/multimaster.launch"

# fkie's tools count from the port of their master: fkie_master_discovery/__init__.py, its zeroconf twin,
# url.py of fkie_node_manager_daemon, and the README of fkie_mas_daemon.
DISCOVERY_OFFSET = 300
ZEROCONF_OFFSET = 600
DAEMON_OFFSET = 1010
_MAS_BASE, _MAS_STEP = 35430 + 255, 101

# A master is offline after 5 s x 2 without a heartbeat (5 beats x 2 below 1 Hz); fkie's default factor is 10.
# Sync then registers everything anew when it is back, since rospy does not reopen a connection that it lost
# (fkie/multimaster_fkie#173).
_OFFLINE = {"measurement_intervals": 5, "timeout_factor": 2}
_RECONNECT = {"resync_on_reconnect": True, "resync_on_reconnect_timeout": 0}


class Fkie:
    """The provider: a discovery node on every hub, and a sync node on hubs that receive topics."""

    needs: Capability = "master"
    settings = frozenset(Multimaster.model_fields) - {"provider", "topics"}
    discovery = Discovery("226.0.0.0", forget_factor=5)  # of master_discovery (multimaster_fkie 0.8)
    memory_mb = 120
    offsets = (DISCOVERY_OFFSET, ZEROCONF_OFFSET, DAEMON_OFFSET)
    relays = False
    only_receivers = False

    def reaches(self, island: Island) -> bool:
        """Returns True: masters find each other."""
        return True

    def listeners(self, spec: Spec, island: Island) -> Iterator[Listener]:
        """Discovery's ports, and those that fkie's GUI takes once somebody opens it."""
        multicast = (spec.multimaster or Multimaster()).port
        hub, master, loc = island.hub, island.master_port, master_loc(spec, island)
        yield Listener(hub, discovery_port(island), "the master discovery", loc)
        yield Listener(hub, multicast, "the master discovery", ("multimaster", "port"), "udp")
        yield Listener(hub, master + ZEROCONF_OFFSET, "fkie's zeroconf", loc, runs=False)
        yield Listener(hub, master + DAEMON_OFFSET, "fkie's node manager", loc, runs=False)
        mas = _MAS_BASE + _MAS_STEP * (master - USUAL_MASTER)
        yield Listener(hub, mas, "fkie's MAS daemon", loc, runs=False)

    def ports(self, swarm: Swarm, island: Island) -> tuple[PortRange, ...]:
        """Returns the ports of discovery, for calls and for heartbeats."""
        calls, beats = discovery_port(island), swarm.multimaster.port
        return PortRange("tcp", calls, calls), PortRange("udp", beats, beats)

    def parts(self, swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
        """Parameters, launch file, and the unit that starts both nodes."""
        files = (release.ros_client(), *_files(swarm, island))
        needed = {package(node.package): ("multimaster",) for node in _nodes(swarm, island)}
        yield Part(files, requires=needed)
        yield _unit(swarm, host, island, files)

    def nodes(self, swarm: Swarm, island: Island) -> JoinNodes:
        """Discovery, and sync where topics arrive; neither publishes diagnostics."""
        return JoinNodes(tuple(f"/{node.name}" for node in _nodes(swarm, island)))


FKIE: MultimasterProvider = Fkie()


def discovery_port(island: Island) -> int:
    """Returns the TCP port on which the discovery node of ``island`` reports the registrations."""
    return island.master_port + DISCOVERY_OFFSET


def _files(swarm: Swarm, island: Island) -> tuple[File, ...]:
    nodes = _nodes(swarm, island)
    params = {node.name: values for node, values in nodes.items()}
    unit = names.unit(swarm.name, names.MULTIMASTER)
    launch = render(
        "multimaster.launch",
        params=f"{ROOT}/{swarm.name}/current/{PARAMS}",
        nodes=list(nodes),
        own=unit,
        by_hand=[unit],
    )
    return (
        File(PARAMS, params_file(params), origin="multimaster"),
        File(LAUNCH, launch, origin="multimaster"),
    )


def _unit(swarm: Swarm, host: Host, island: Island, files: tuple[File, ...]) -> Part:
    """The unit; it waits for the master and restarts with it."""
    name = names.unit(swarm.name, names.MULTIMASTER)
    owner = level_of(island.security).port_owner(host)
    text = render(
        "multimaster.service",
        **service_values(swarm, host),
        command=_command(swarm),
        address=host.ros_address,
        ports=(discovery_port(island), f"udp:{swarm.multimaster.port}"),
        owner=owner,
        runtime=names.runtime_folder(swarm.name, names.MULTIMASTER),
    )
    file = File(f"units/{name}", text, origin="multimaster")
    waits = (release.WAIT,) if owner else ()
    return Part((file,), (Unit(name, (file.path, *waits, *release.RUNNING, *(one.path for one in files))),))


def _command(swarm: Swarm) -> tuple[str, ...]:
    """Starts both nodes under the master that is there: without `--wait` roslaunch may start its own."""
    return ("roslaunch", "--wait", "--skip-log-check", f"{ROOT}/{swarm.name}/current/{LAUNCH}")


def _nodes(swarm: Swarm, island: Island) -> Mapping[Node, Mapping[str, Any]]:
    """The nodes beside a master with their parameters.

    Sync is left out where no topic arrives: with an empty list of topics it would accept all of them.
    """
    family = FAMILIES[swarm.multimaster.packages]
    incoming = _incoming(swarm, island)
    nodes: dict[Node, Mapping[str, Any]] = {family.discovery: _discovery_params(swarm, island)}
    return nodes | {family.sync: _sync_params(swarm, incoming)} if incoming else nodes


def _discovery_params(swarm: Swarm, island: Island) -> Mapping[str, Any]:
    """How the master of ``island`` announces itself to the others."""
    settings = swarm.multimaster
    others = [other.hub for other in swarm.islands if other is not island]
    networks = [] if swarm.overlay else swarm.networks  # WireGuard carries no multicast
    multicast = any(one.multicast is not False for one in networks if island.hub in one.hosts)
    return {
        "name": island.hub,
        "mcast_group": settings.group,
        "mcast_port": settings.port,
        "send_mcast": multicast,
        "listen_mcast": multicast,
        "robot_hosts": [swarm.hosts[hub].ros_address for hub in settings.robot_hosts.get(island.hub, others)],
        **_interface(swarm.hosts[island.hub]),
        "rpc_port": discovery_port(island),
        "rosmaster_hz": 1.0,
        "heartbeat_hz": settings.heartbeat_hz,
        **_OFFLINE,
        "active_request_after": settings.active_request_after,
        "remove_after": settings.remove_after,
    }


def _interface(hub: Host) -> Mapping[str, Any]:
    """Where to send and listen: fkie uses ROS_IP, and on the hub its own name may resolve to 127.0.1.1."""
    return {"interface": hub.ros_address} if hub.advertised != hub.ros_address else {}


def _sync_params(swarm: Swarm, incoming: Mapping[str, list[str]]) -> Mapping[str, Any]:
    """What a master copies from the others: by hub, the topics ``incoming`` here.

    `sync_hosts` leaves out masters that are not named; together with it, `ignore_hosts` would admit them.
    """
    several = any(len(other.hosts) > 1 for other in swarm.islands if other.hub in incoming)
    return {
        "sync_hosts": list(incoming),
        "sync_topics": [{hub: topics} for hub, topics in incoming.items()],
        "ignore_subscribers": ["*"],
        "ignore_services": ["*"],
        "sync_remote_nodes": several,
        "sync_topics_on_demand": False,
        **_RECONNECT,
    }


def _incoming(swarm: Swarm, island: Island) -> dict[str, list[str]]:
    """By hub of origin, the topics that are bridged to ``island``."""
    hubs = {other.name: other.hub for other in swarm.islands if other.has_master}
    incoming = swarm.received.get(island.name, {})
    return {hubs[origin]: list(topics) for origin, topics in incoming.items() if origin in hubs}
