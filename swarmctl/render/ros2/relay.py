"""Provider `relay`: a node in the domains of several islands, which brings their topics to its own. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Part, Unit, package
from swarmctl.render.middleware import Capability
from swarmctl.render.multimaster import MultimasterProvider, OneNode
from swarmctl.render.quoting import render
from swarmctl.render.ros2 import discovery_files, graph_environment, ros2_release
from swarmctl.render.ros2.discovery_files import HUMBLE
from swarmctl.render.yaml_params import params_file
from swarmctl.swarm import names
from swarmctl.swarm.ports import DRAWN, PortRange
from swarmctl.swarm.resolved import Host, Island, Swarm

PARAMS, _ENVIRONMENT = "params/relay.yaml", "env/relay.env"
_OWN, _OF_RELAY = "env/", "env/relay."  # files that DDS reads


class Relay(OneNode):
    """The provider: one node on each hub that receives topics."""

    needs: Capability = "domains"
    memory_mb = 90
    relays = True

    def reaches(self, island: Island) -> bool:
        """Returns True if nodes of another island find it; of a server, if that can be another for each."""
        method = island.discovery.method
        return method in ("peers", "multicast", "zenoh") or (method == "server" and island.distro != HUMBLE)

    def ports(self, swarm: Swarm, island: Island) -> Sequence[PortRange]:
        """Returns where nodes and masters of ROS 1 reach it: at ports that Linux draws."""
        exchanges = any("master" in one for one in _peers(swarm, island))
        return (DRAWN,) if exchanges else ()

    def parts(self, swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
        """Yields the node, its parameters, the settings of DDS, and its unit."""
        params = File(PARAMS, params_file(_parameters(swarm, island)), origin="multimaster")
        shipped = (ros2_release.wait_for_address(), *shipped_files.folder("domain_relay", ros2_release.FACE))
        files = (params, *_settings(swarm, host, island), *shipped)
        peers = _peers(swarm, island)
        kinds = {one["type"] for peer in peers for one in (*peer["receives"], *peer.get("sends", ()))}
        packages = sorted({kind.partition("/")[0] for kind in kinds} | {"rclpy", "diagnostic_msgs"})
        yield Part(files, requires={package(name): ("multimaster",) for name in packages})
        yield _unit(swarm, host, island, files)


RELAY: MultimasterProvider = Relay()


def _joined(swarm: Swarm, island: Island) -> Island:
    """The island with the hosts of all from which topics come: there the node looks for others."""
    islands = {one.name: one for one in swarm.islands}
    peers = (islands[peer] for peer in swarm.received.get(island.name, {}))
    others = (host for peer in peers if not peer.has_master for host in peer.hosts)
    return replace(island, hosts=tuple(dict.fromkeys((*island.hosts, *others))))


def _settings(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """The environment of the node, and the files that it names."""
    joined = _joined(swarm, island)
    variables = {
        name: value.replace(f"/{_OWN}", f"/{_OF_RELAY}")
        for name, value in graph_environment.of_people(swarm, host, joined).items()
    }
    for file in discovery_files.files(swarm, host, joined):
        yield replace(file, path=file.path.replace(_OWN, _OF_RELAY, 1))
    text = render(
        "ros2/ros.env",
        swarm=swarm.name,
        distro=island.distro,
        variables=list(variables.items()),
        address=graph_environment.own_address(host, joined),
        workspaces=host.workspaces,
    )
    yield File(_ENVIRONMENT, text, origin="multimaster")


def _unit(swarm: Swarm, host: Host, island: Island, files: tuple[File, ...]) -> Part:
    name = names.unit(swarm.name, names.MULTIMASTER)
    text = render(
        "ros2/relay.service",
        **ros2_release.unit_values(swarm, host, _joined(swarm, island)),
        runtime=names.runtime_folder(swarm.name, names.MULTIMASTER),
        environment=_ENVIRONMENT,
        params=PARAMS,
    )
    file = File(f"units/{name}", text, origin="multimaster")
    read = (*ros2_release.running(swarm, host, island), *(one.path for one in files))
    return Part((file,), (Unit(name, (file.path, *read)),))


def _parameters(swarm: Swarm, island: Island) -> dict[str, Any]:
    """What the node reads: its peers, and the topics that come from each."""
    peers = list(_peers(swarm, island))
    address = swarm.hosts[island.hub].advertised
    return {
        "island": island.name,
        "node": names.multimaster_node(island.name),
        "domain": island.discovery.domain,
        **({"address": address} if any("master" in one for one in peers) else {}),
        "peers": peers,
    }


def _peers(swarm: Swarm, island: Island) -> Iterator[dict[str, Any]]:
    """The islands with which topics are exchanged; to one without a master they go by its own relay."""
    for peer in swarm.islands:
        receives, sends = _crossing(swarm, peer, island), _crossing(swarm, island, peer)
        if peer.has_master and (receives or sends):
            yield {
                "island": peer.name,
                "master": swarm.master_uri(peer),
                "hosts": list(swarm.uri_hosts_of(peer)),
                "receives": receives,
                "sends": sends,
            }
        elif receives:
            environment = graph_environment.of_visitors(swarm, peer)
            yield {
                "island": peer.name,
                "domain": peer.discovery.domain,
                **({"environment": environment} if environment else {}),
                "receives": receives,
            }


def _crossing(swarm: Swarm, origin: Island, to: Island) -> list[dict[str, Any]]:
    commands = {one.topic for one in swarm.command_topics.values()}
    topics = swarm.received.get(to.name, {}).get(origin.name, {})
    return [{"topic": topic, "type": kind, "command": topic in commands} for topic, kind in topics.items()]
