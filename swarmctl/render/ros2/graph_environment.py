"""The environment variables by which programs become nodes of an island. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from swarmctl.render.ros2 import enclaves
from swarmctl.render.ros2.discovery_files import (
    CYCLONE,
    FASTDDS,
    FASTDDS_2,
    HUMBLE,
    LOOPBACK,
    SUPER_CLIENT,
    needs_fastdds_file,
    peers_by_file,
    robots_with_nodes,
)
from swarmctl.render.service_values import home, toward_robots
from swarmctl.spec.ros_model import Rmw
from swarmctl.swarm import names
from swarmctl.swarm.addresses import bracketed, is_ipv6
from swarmctl.swarm.resolved import ForeignDriver, Host, Island, Robot, Swarm

IMPLEMENTATIONS: Mapping[Rmw, str] = {
    "fastrtps": "rmw_fastrtps_cpp",
    "cyclonedds": "rmw_cyclonedds_cpp",
    "zenoh": "rmw_zenoh_cpp",
}
SERVER_PORT, ROUTER_PORT = 11811, 7447
_PROFILES, _PROFILES_2 = "FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE"
#: Every variable that decides how nodes find each other; those that an island does not set are unset.
GRAPH_VARIABLES = (
    "ROS_DOMAIN_ID",
    "RMW_IMPLEMENTATION",
    "ROS_DISCOVERY_SERVER",
    "ROS_SUPER_CLIENT",
    "ROS_EASY_MODE",
    "ROS2_EASY_MODE",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "ROS_LOCALHOST_ONLY",
    _PROFILES,
    _PROFILES_2,
    "CYCLONEDDS_URI",
    "ZENOH_ROUTER_CHECK_ATTEMPTS",
    "ZENOH_CONFIG_OVERRIDE",
    "ROS_SECURITY_ENABLE",
    "ROS_SECURITY_STRATEGY",
    "ROS_SECURITY_KEYSTORE",
    "ROS_SECURITY_ENCLAVE_OVERRIDE",
)


def of_nodes(swarm: Swarm, host: Host, island: Island) -> dict[str, str]:
    """Returns what makes programs on ``host`` nodes of ``island``."""
    rmw = island.discovery.rmw
    return {
        "ROS_DOMAIN_ID": str(island.discovery.domain),
        "RMW_IMPLEMENTATION": IMPLEMENTATIONS[rmw],
        **_METHODS[rmw](swarm, host, island),
        **(_sros2(swarm, host) if swarm.sros2 else {}),
    }


def of_people(swarm: Swarm, host: Host, island: Island) -> dict[str, str]:
    """Returns the same for people at a terminal, whose tools get the whole graph from a discovery server."""
    variables = of_nodes(swarm, host, island)
    if island.discovery.method != "server":
        return variables
    if island.distro == HUMBLE:
        return {**variables, _PROFILES_2: f"{home(swarm)}/current/{SUPER_CLIENT}"}
    return {**variables, "ROS_SUPER_CLIENT": "TRUE"}


def of_visitors(swarm: Swarm, island: Island) -> dict[str, str]:
    """Returns what a node that runs on another island needs besides the domain of ``island``."""
    if island.discovery.method == "zenoh":
        # A peer starts before the router is there, and connects later; a client fails.
        visits = 'mode="peer";listen/endpoints=[];connect/exit_on_failure=false'
        return {
            "ZENOH_ROUTER_CHECK_ATTEMPTS": "-1",  # none
            "ZENOH_CONFIG_OVERRIDE": f"{visits};connect/endpoints={_endpoints(_servers(swarm, island))}",
        }
    return _discovery_server(swarm, island) if island.discovery.method == "server" else {}


def of_robots(swarm: Swarm, host: Host, island: Island) -> Iterator[str]:
    """Yields what a person sets on each robot of ``host`` that runs nodes itself."""
    for robot in swarm.robots_on(host.name):
        if robot.node_address is None or not isinstance(robot.driver, ForeignDriver):
            continue
        namespace, servers = robot.driver.ros.peer_namespace, _servers_of(swarm, host, island, robot)
        values = (
            f"domain {island.discovery.domain}",
            IMPLEMENTATIONS[island.discovery.rmw],
            *([f"namespace /{namespace}"] if namespace else []),
            *([servers] if island.discovery.servers else []),
        )
        yield f"robot {robot.name} ({robot.node_address}) runs nodes itself; set on it: {', '.join(values)}"


def _servers_of(swarm: Swarm, host: Host, island: Island, robot: Robot) -> str:
    """The servers that a robot reaches, each at the place of its id; over a cable only that of its host."""
    reached = {name: swarm.hosts[name].ros_address for name in island.discovery.servers}
    if robot.host_address is not None:
        reached = {name: robot.host_address for name in reached if name == host.name}
    if not reached:
        return f"and add {host.name} to `ros.servers`: over its link it reaches no other host"
    if island.discovery.method == "zenoh":
        return f"routers {_endpoints(reached.values())}"
    places = (
        f"{bracketed(reached[one])}:{SERVER_PORT}" if one in reached else ""
        for one in island.discovery.servers
    )
    return f"discovery server {';'.join(places).rstrip(';')}"


def own_address(host: Host, island: Island) -> str:
    """Returns the address that nodes of ``host`` need at their start; empty if they leave no host."""
    return "" if island.discovery.method == "local" or len(island.hosts) == 1 else host.ros_address


def router_override(swarm: Swarm, host: Host, island: Island) -> str:
    """Returns the settings of the Zenoh router of ``host``: all routers connect to the first."""
    first, *_ = _servers(swarm, island)
    listens = host.ros_address
    if toward_robots(swarm, host):  # it does not start at an address that is not there
        listens = _every_address(host)
    elif len(island.hosts) == 1:  # its own nodes need no network
        listens = LOOPBACK if len(swarm.islands) == 1 else _every_address(host)
    listen = f"listen/endpoints={_endpoints([listens])}"
    return listen if host.ros_address == first else f"{listen};connect/endpoints={_endpoints([first])}"


def _fastrtps(swarm: Swarm, host: Host, island: Island) -> dict[str, str]:
    found = _range(swarm, host, island)
    if peers_by_file(swarm, island):
        found = {} if island.distro == HUMBLE else {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}
    if island.discovery.method == "server":
        found = _discovery_server(swarm, island)
    if needs_fastdds_file(swarm, host, island):
        variable = _PROFILES_2 if island.distro in FASTDDS_2 else _PROFILES
        found[variable] = f"{home(swarm)}/current/{FASTDDS}"
    return found


def _discovery_server(swarm: Swarm, island: Island) -> dict[str, str]:
    servers = (f"{bracketed(one)}:{SERVER_PORT}" for one in _servers(swarm, island))
    return {"ROS_DISCOVERY_SERVER": ";".join(servers)}


def _cyclonedds(swarm: Swarm, host: Host, island: Island) -> dict[str, str]:
    found = _range(swarm, host, island)
    if island.discovery.method != "local":
        found["CYCLONEDDS_URI"] = f"file://{home(swarm)}/current/{CYCLONE}"
    return found


def _zenoh(swarm: Swarm, host: Host, island: Island) -> dict[str, str]:
    """Clients of the routers: a peer without its router receives nothing, and reports no error."""
    routers = [LOOPBACK] if len(island.hosts) == 1 else _servers(swarm, island)
    return {
        "ZENOH_ROUTER_CHECK_ATTEMPTS": "0",  # without limit
        "ZENOH_CONFIG_OVERRIDE": f'mode="client";connect/endpoints={_endpoints(routers)}',
    }


def _sros2(swarm: Swarm, host: Host) -> dict[str, str]:
    """With the enclave of people; that of a unit takes its place."""
    return {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_KEYSTORE": f"/run/{names.runtime_folder(swarm.name, names.ENCLAVES)}",
        "ROS_SECURITY_ENCLAVE_OVERRIDE": f"/{enclaves.of_host(swarm, host).name}",
    }


_METHODS = {"fastrtps": _fastrtps, "cyclonedds": _cyclonedds, "zenoh": _zenoh}


def _range(swarm: Swarm, host: Host, island: Island) -> dict[str, str]:
    """How far discovery by DDS itself reaches."""
    method = island.discovery.method
    if island.distro == HUMBLE:
        return {"ROS_LOCALHOST_ONLY": "1"} if method == "local" else {}
    found = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET" if method == "multicast" else "LOCALHOST"}
    hosts = [swarm.hosts[name] for name in island.hosts if name != host.name and method == "peers"]
    others = [one.ros_address for one in hosts]
    if method != "multicast" and (peers := [*others, *robots_with_nodes(swarm, host)]):
        found["ROS_STATIC_PEERS"] = ";".join(peers)
    return found


def _servers(swarm: Swarm, island: Island) -> list[str]:
    return [swarm.hosts[name].ros_address for name in island.discovery.servers]


def _every_address(host: Host) -> str:
    return "::" if is_ipv6(host.ros_address) else "0.0.0.0"


def _endpoints(addresses: Iterable[str]) -> str:
    return "[" + ",".join(f'"tcp/{bracketed(one)}:{ROUTER_PORT}"' for one in addresses) + "]"
