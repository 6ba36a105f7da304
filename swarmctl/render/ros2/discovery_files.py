"""The XML files that DDS reads: which addresses its nodes use, and where they look for others. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.render.bundle import File
from swarmctl.render.quoting import render
from swarmctl.swarm.addresses import ip_of, is_ipv6
from swarmctl.swarm.resolved import Host, Island, Swarm

FASTDDS, SUPER_CLIENT, CYCLONE = "env/fastdds.xml", "env/super_client.xml", "env/cyclonedds.xml"
HUMBLE = "humble"  # the last without ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_SUPER_CLIENT
FASTDDS_2 = (HUMBLE, "jazzy")  # distributions with Fast DDS 2, which has its own variable for profiles
LOOPBACK = "127.0.0.1"
#: Participants of a host that others can look for: twice the processes of a busy robot.
MOST_PARTICIPANTS = 32
#: How many they look for: each costs each node a packet every 3 s. Few steps, as a change restarts all nodes.
_STEPS = (8, 16, MOST_PARTICIPANTS)


def files(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """Yields the files that the nodes of ``host`` and people at its terminals read."""
    discovery, origin = island.discovery, f"hosts.{host.name}"
    if discovery.rmw == "cyclonedds" and discovery.method != "local":
        yield File(CYCLONE, _cyclonedds(swarm, host, island), origin=origin)
    if needs_fastdds_file(swarm, host, island):
        yield File(FASTDDS, _fastdds(swarm, host, island), origin=origin)
    if island.distro == HUMBLE and discovery.method == "server":
        servers = [
            (f"44.53.{number:02x}.5f.45.50.52.4f.53.49.4d.41", swarm.hosts[name].ros_address)
            for number, name in enumerate(discovery.servers)
        ]
        yield File(SUPER_CLIENT, _fastdds(swarm, host, island, servers), origin=origin)


def needs_fastdds_file(swarm: Swarm, host: Host, island: Island) -> bool:
    """True if Fast DDS on ``host`` needs more than environment variables."""
    discovery = island.discovery
    if discovery.rmw != "fastrtps":
        return False
    by_address = discovery.method != "local" and ip_of(host.ros_address) is not None
    return by_address or peers_by_file(swarm, island)


def peers_by_file(swarm: Swarm, island: Island) -> bool:
    """True if a profile names the peers.

    For Fast DDS 2 the variables would add shared memory (see the template); rmw_fastrtps does not resolve
    an IPv6 address in them.
    """
    method = island.discovery.method
    if method == "peers" and any(is_ipv6(swarm.hosts[name].ros_address) for name in island.hosts):
        return True
    return island.distro in FASTDDS_2 and method in ("peers", "local")


def robots_with_nodes(swarm: Swarm, host: Host) -> list[str]:
    """Returns the addresses of the robots of ``host`` that run nodes themselves."""
    return [robot.node_address for robot in swarm.robots_on(host.name) if robot.node_address]


def _fastdds(swarm: Swarm, host: Host, island: Island, servers: list[tuple[str, str]] | None = None) -> bytes:
    local, robots = island.discovery.method == "local", robots_with_nodes(swarm, host)
    peers = [LOOPBACK] if local else [swarm.hosts[name].ros_address for name in island.hosts]
    ipv6 = not local and is_ipv6(host.ros_address)
    own = [LOOPBACK] if local else [LOOPBACK, host.ros_address] if ip_of(host.ros_address) else []
    return render(
        "ros2/fastdds.xml",
        ip="v6" if ipv6 else "v4",
        # The network of a robot with nodes is in no spec; with a list of IPv6 addresses no message arrives.
        addresses=[] if robots or ipv6 else own,
        peers=[*peers, *robots] if peers_by_file(swarm, island) else [],
        most=_sought(swarm, island) if island.discovery.method in ("peers", "local") else 0,
        servers=servers or [],
    )


def _sought(swarm: Swarm, island: Island) -> int:
    """Returns how many participants of each host a node looks for: twice the processes of the busiest.

    Of two nodes, the one with the higher number finds the other, so tools of people are found as well.
    """
    processes = (
        sum(1 + robot.gated for robot in swarm.robots_on(name)) + len(swarm.programs_on(name))
        for name in island.hosts
    )
    needed = 2 * max(processes, default=0)
    return next((one for one in _STEPS if one >= needed), MOST_PARTICIPANTS)


def _cyclonedds(swarm: Swarm, host: Host, island: Island) -> bytes:
    by_peers, robots = island.discovery.method == "peers", robots_with_nodes(swarm, host)
    return render(
        "ros2/cyclonedds.xml",
        address=host.ros_address if ip_of(host.ros_address) and not robots else "",
        ipv6=is_ipv6(host.ros_address),
        multicast=not by_peers,
        most=MOST_PARTICIPANTS,
        peers=[*(swarm.hosts[name].ros_address for name in island.hosts), *robots] if by_peers else [],
    )
