"""The ports that an island takes: of its servers, and of DDS by its domain. Pure.

Ports of DDS: https://docs.ros.org/en/kilted/Concepts/Intermediate/About-Domain-ID.html
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from swarmctl.render.ros2.discovery_files import FASTDDS_2, MOST_PARTICIPANTS
from swarmctl.render.ros2.graph_environment import ROUTER_PORT, SERVER_PORT
from swarmctl.swarm.ports import Listener, Loc, PortRange
from swarmctl.swarm.resolved import Island

_BASE, _BY_DOMAIN, _BY_PROCESS, _LAST = 7400, 250, 2, 65535
_MOST = (_BY_DOMAIN - 10) // _BY_PROCESS  # before the ports of the next domain


def listeners(island: Island, processes: Mapping[str, int]) -> Iterator[Listener]:
    """Yields every port that the hosts of ``island`` take for ROS."""
    discovery = island.discovery
    for number, host in enumerate(discovery.servers):
        loc: Loc = ("ros", "servers", number)
        if discovery.method == "zenoh":
            yield Listener(host, ROUTER_PORT, "the Zenoh router", loc)
        else:
            yield Listener(host, SERVER_PORT, "the discovery server", loc, "udp")
    if discovery.rmw != "zenoh":
        for host in island.hosts:
            yield from _of_domain(island, host, processes.get(host, 0))


def _of_domain(island: Island, host: str, processes: int) -> Iterator[Listener]:
    loc: Loc = ("ros", "domain")
    first, what = _BASE + _BY_DOMAIN * island.discovery.domain, f"DDS in domain {island.discovery.domain}"
    if island.discovery.method != "server":
        yield Listener(host, first, what, loc, "udp")  # discovery by multicast, of all processes
    for process in range(processes):
        for port in (first + 10 + _BY_PROCESS * process, first + 11 + _BY_PROCESS * process):
            yield Listener(host, port, what, loc, "udp")


def ranges(island: Island) -> tuple[PortRange, ...]:
    """Returns every port that a host of ``island`` may take for ROS: of its domain, and of a server."""
    discovery = island.discovery
    if discovery.rmw == "zenoh":
        return (PortRange("tcp", ROUTER_PORT, ROUTER_PORT),)
    first = _BASE + _BY_DOMAIN * discovery.domain
    of_domain = PortRange("udp", first, min(first + _BY_DOMAIN - 1, _LAST))
    return (of_domain, PortRange("udp", SERVER_PORT, SERVER_PORT)) if discovery.servers else (of_domain,)


def most_processes(distro: str, island: Island) -> int | None:
    """Returns how many processes with nodes each host of ``island`` can run; None without a limit."""
    discovery = island.discovery
    if discovery.rmw == "zenoh":
        return None
    numbered = discovery.method == "peers" or (discovery.method == "local" and distro in FASTDDS_2)
    return MOST_PARTICIPANTS if numbered or discovery.rmw == "cyclonedds" else _MOST
