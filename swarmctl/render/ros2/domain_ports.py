"""The ports that an island takes: of its servers, and of DDS by its domain. Pure.

Ports of DDS: https://docs.ros.org/en/kilted/Concepts/Intermediate/About-Domain-ID.html
"""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.render.ros2.graph_environment import ROUTER_PORT, SERVER_PORT
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.spec.model import Spec
from swarmctl.swarm.modes import driving_host
from swarmctl.swarm.ports import Listener, Loc
from swarmctl.swarm.resolved import Island

_BASE, _BY_DOMAIN, _BY_PROCESS = 7400, 250, 2


def listeners(spec: Spec, island: Island) -> Iterator[Listener]:
    """Yields every port that the hosts of ``island`` take for ROS."""
    discovery = island.discovery
    for number, host in enumerate(discovery.servers):
        loc: Loc = ("ros", "servers", number) if spec.ros.servers else ("ros", "distro")
        if discovery.method == "zenoh":
            yield Listener(host, ROUTER_PORT, "the Zenoh router", loc)
        else:
            yield Listener(host, SERVER_PORT, "the discovery server", loc, "udp")
    if discovery.rmw != "zenoh":
        for host in island.hosts:
            yield from _of_domain(spec, island, host)


def _of_domain(spec: Spec, island: Island, host: str) -> Iterator[Listener]:
    loc: Loc = ("ros", "domain") if spec.ros.domain is not None else ("ros", "distro")
    first, what = _BASE + _BY_DOMAIN * island.discovery.domain, f"DDS in domain {island.discovery.domain}"
    if island.discovery.method != "server":
        yield Listener(host, first, what, loc, "udp")  # discovery by multicast, of all processes
    for process in range(_processes(spec, host)):
        for port in (first + 10 + _BY_PROCESS * process, first + 11 + _BY_PROCESS * process):
            yield Listener(host, port, what, loc, "udp")


def _processes(spec: Spec, host: str) -> int:
    """How many processes with nodes run on ``host``, at least; gates are in front of ROS packages."""
    robots = [one for name, one in spec.robots.items() if driving_host(spec, name) == host]
    gates = sum(isinstance(one.driver, RosDriver) and not one.driver.ungated for one in robots)
    placed = (
        one.host or (driving_host(spec, one.robot) if one.robot in spec.robots else None)
        for one in spec.programs.values()
    )
    return len(robots) + gates + sum(one == host for one in placed)
