"""What ROS 2 on a host consists of: environment, discovery server or router, helper scripts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.middleware import DiscoveryServers
from swarmctl.render.quoting import render
from swarmctl.render.ros2 import discovery_files, graph_environment
from swarmctl.render.security_level import level_of
from swarmctl.render.service_values import home, service_values, toward_robots
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Island, Swarm

ENVIRONMENT, RESTART_DELAY = "env/ros.env", "bin/restart-delay"
_WAIT, RUN_NODE = "bin/wait-for-address", "bin/run-node"
_EXEC = "bin/ros-exec"
FACE = "ros2"  # of `swarm_onboard`


def files(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """Yields what every ROS program on this host runs in."""
    yield File(
        ENVIRONMENT,
        render(
            "ros2/ros.env",
            swarm=swarm.name,
            distro=island.distro,
            variables=list(graph_environment.of_nodes(swarm, host, island).items()),
            address=graph_environment.own_address(host, island),
            workspaces=host.workspaces,
        ),
        origin=f"hosts.{host.name}",
    )
    yield from discovery_files.files(swarm, host, island)
    yield File(_EXEC, shipped_files.text("ros2/ros-exec"), 0o755)
    yield File(RUN_NODE, shipped_files.text("ros2/run-node"), 0o755)
    yield File(RESTART_DELAY, shipped_files.text("os/restart-delay"), 0o755)
    if graph_environment.own_address(host, island):
        yield wait_for_address()


def wait_for_address() -> File:
    """Returns the program that waits until a host has its address."""
    return File(_WAIT, shipped_files.text("os/wait-for-address"), 0o755)


def running(swarm: Swarm, host: Host, island: Island) -> tuple[str, ...]:
    """Returns the files whose change restarts every ROS program of this host."""
    read = (one.path for one in discovery_files.files(swarm, host, island))
    of_dds = (one for one in read if one != discovery_files.SUPER_CLIENT)
    waits = (_WAIT,) if graph_environment.own_address(host, island) else ()
    return (ENVIRONMENT, *of_dds, _EXEC, RESTART_DELAY, *waits)


def setup_script(swarm: Swarm, host: Host, island: Island) -> File:
    """Returns what people source at a terminal to use the ROS of the swarm."""
    variables = graph_environment.of_people(swarm, host, island)
    text = render(
        "ros2/setup.bash",
        swarm=swarm.name,
        distro=island.distro,
        home=home(swarm),
        workspaces=host.workspaces,
        unset=[name for name in graph_environment.GRAPH_VARIABLES if name not in variables],
        variables=list(variables.items()),
    )
    return File("setup.bash", text, origin=f"hosts.{host.name}")


def server_unit(swarm: Swarm, host: Host, island: Island) -> Part:
    """Returns the unit of the discovery server, or of the Zenoh router, of ``host``."""
    name = names.unit(swarm.name, names.DISCOVERY)
    is_router = island.discovery.method == "zenoh"
    text = render(
        "ros2/discovery.service",
        **unit_values(swarm, host, island),
        port=graph_environment.ROUTER_PORT if is_router else f"udp:{graph_environment.SERVER_PORT}",
        owner=level_of(island.security).port_owner(host),
        island=island.name,
        command=_server(swarm, host, island),
        runtime=names.runtime_folder(swarm.name, names.DISCOVERY),
    )
    file = File(f"units/{name}", text, origin="ros")
    waits = (_WAIT,) if graph_environment.own_address(host, island) else ()
    needs = (file.path, ENVIRONMENT, _EXEC, RUN_NODE, RESTART_DELAY, *waits)
    return Part((file,), (Unit(name, needs),))


def servers(swarm: Swarm, island: Island) -> DiscoveryServers | None:
    """Returns the servers over which the nodes of ``island`` find each other, if they need some."""
    if not (hosts := island.discovery.servers):
        return None
    unit = names.unit(swarm.name, names.DISCOVERY)
    if island.discovery.method == "zenoh":
        return DiscoveryServers(hosts, unit, graph_environment.ROUTER_PORT, "tcp")
    return DiscoveryServers(hosts, unit, graph_environment.SERVER_PORT, "udp")


def unit_values(swarm: Swarm, host: Host, island: Island) -> dict[str, Any]:
    """Returns the template values that all units of this host share."""
    address = graph_environment.own_address(host, island)
    return {**service_values(swarm, host, master=False), "address": address}


def run_node(swarm: Swarm, package: str, executable: str) -> tuple[str, ...]:
    """Returns the words that run an executable of a package, before those of its command line."""
    return f"{home(swarm)}/current/{RUN_NODE}", package, executable


def _server(swarm: Swarm, host: Host, island: Island) -> tuple[str, ...]:
    discovery = island.discovery
    if discovery.method == "zenoh":
        override = graph_environment.router_override(swarm, host, island)
        router = run_node(swarm, "rmw_zenoh_cpp", "rmw_zenohd")
        return "/usr/bin/env", f"ZENOH_CONFIG_OVERRIDE={override}", *router
    number, port = discovery.servers.index(host.name), f"{graph_environment.SERVER_PORT}"
    addresses = (host.ros_address, *toward_robots(swarm, host))
    listening = (word for one in addresses for word in ("-l", one, "-p", port))
    return "fastdds", "discovery", "-i", f"{number}", *listening
