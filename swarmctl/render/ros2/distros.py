"""ROS 2 behind the ``Middleware`` protocol: no master, domains, discovery servers or Zenoh routers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from swarmctl.render import expected_nodes, program_parts, sketch
from swarmctl.render.bag_recorder import MCAP
from swarmctl.render.bundle import File, Part
from swarmctl.render.middleware import (
    Capability,
    DiscoveryServers,
    ExpectedDriver,
    ExpectedNode,
    Middleware,
)
from swarmctl.render.ros2 import (
    ament_packages,
    discovery_files,
    domain_ports,
    enclaves,
    graph_environment,
    ros2_drivers,
    ros2_programs,
    ros2_release,
)
from swarmctl.render.topic_tool import TopicTool, sent
from swarmctl.resources import HostModule, onboard
from swarmctl.spec.model import Spec
from swarmctl.swarm.flow import Service
from swarmctl.swarm.ports import Listener, PortRange
from swarmctl.swarm.resolved import Host, Island, Program, Robot, Swarm
from swarmctl.swarm.topics import DIAGNOSTICS, DIAGNOSTICS_TYPE, DriverTopic

#: Topics without a namespace that ROS itself or every driver publishes.
TOPICS = {
    DIAGNOSTICS: DIAGNOSTICS_TYPE,
    "/clock": "rosgraph_msgs/Clock",
    "/rosout": "rcl_interfaces/Log",
    "/parameter_events": "rcl_interfaces/ParameterEvent",
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
}


class Ros2:
    """The middleware of a distribution of ROS 2."""

    capabilities: frozenset[Capability] = frozenset({"launched", "domains"})
    settings = frozenset({"rmw", "domain", "discovery", "servers", "workspace", "sros2"})
    variables = frozenset(graph_environment.GRAPH_VARIABLES)
    launcher = "ros2 launch"
    bag_recorder = MCAP
    multimaster = "relay"
    shared_files = frozenset({ros2_release.ENVIRONMENT})  # the domain, and where the servers are
    topics = TOPICS
    master_mb = 0
    probe = HostModule("swarm_onboard.ros2_probe.observe", onboard().parent)

    def __init__(self, distro: str) -> None:
        self._distro = distro
        if distro != discovery_files.HUMBLE:
            self.capabilities |= {"ipv6-servers"}

    @property
    def topic_tool(self) -> TopicTool:
        """Returns swarmctl's own program, which needs no `ros2` command."""
        return TopicTool(sent("swarm_onboard.ros2_tools.topic"), "rclpy")

    def robots(self, swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
        """Yields the environment, the discovery server on its hosts, and the drivers."""
        yield Part(
            files=(*ros2_release.files(swarm, host, island), *ros2_drivers.files(swarm, host)),
            requires=ament_packages.requires(swarm, host, island),
            wants=sketch.wants(swarm, host),
            by_hand=tuple(graph_environment.of_robots(swarm, host, island)),
        )
        yield enclaves.enclave_part(swarm, host)
        if host.name in island.discovery.servers:
            yield ros2_release.server_unit(swarm, host, island)
        yield from ros2_drivers.units(swarm, host, island)

    def programs(self, swarm: Swarm, host: Host) -> Iterator[Part]:
        """Yields the programs with their parameters or launch files."""
        forms = program_parts.secret_forms(swarm, host)
        yield Part(
            files=tuple(ros2_programs.files(swarm, host)),
            requires=ament_packages.of_programs(swarm, host),
            secrets=tuple(forms),
            secret_forms=forms,
        )
        yield from ros2_programs.units(swarm, host, swarm.island_of(host.name))

    def launch_files(self, swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
        """`setup.bash`, a launch file of all drivers, a script for each interactive program."""
        yield ros2_release.setup_script(swarm, host, island)
        if swarm.robots_on(host.name):
            yield ros2_drivers.launch_file(swarm, host)
        yield from ros2_programs.terminal_scripts(swarm, host, island)

    def master(self, swarm: Swarm, island: Island) -> None:
        """Returns None: nodes find each other without one."""

    def discovery_servers(self, swarm: Swarm, island: Island) -> DiscoveryServers | None:
        """Returns the discovery servers of Fast DDS, or the routers of Zenoh."""
        return ros2_release.servers(swarm, island)

    def driver(self, swarm: Swarm, robot: Robot) -> ExpectedDriver:
        """Returns the driver's node, with one topic per reading."""
        found = expected_nodes.driver(swarm, robot)
        gate = found.gate
        if gate is not None:
            gate = replace(
                gate, output_type=self.type_name(gate.output_type), reports=self._named(gate.reports)
            )
        return replace(
            found,
            topics=tuple(map(self._named, found.topics)),
            command_type=self.type_name(found.command_type),
            gate=gate,
        )

    def program(self, swarm: Swarm, program: Program) -> ExpectedNode:
        """Returns the program's node; one of a launch file has no known name."""
        found = expected_nodes.program(swarm, program)
        return replace(
            found,
            publishes=tuple((topic, self.type_name(kind)) for topic, kind in found.publishes),
            subscribes=tuple((topic, self.type_name(kind)) for topic, kind in found.subscribes),
            measured=tuple(map(self._named, found.measured)),
        )

    def _named(self, topic: DriverTopic) -> DriverTopic:
        return replace(topic, type=self.type_name(topic.type))

    def type_name(self, kind: str) -> str:
        """Returns ``nav_msgs/msg/Odometry`` for ``nav_msgs/Odometry``."""
        package, slash, name = kind.partition("/")
        return f"{package}/msg/{name.rpartition('/')[2]}" if slash else kind

    def listeners(self, spec: Spec, island: Island, processes: Mapping[str, int]) -> Iterator[Listener]:
        """Yields the ports of servers and of DDS on all hosts of ``island``."""
        return domain_ports.listeners(island, processes)

    def ports(self, island: Island) -> Mapping[Service, Sequence[PortRange]]:
        """Returns the ports of servers, and those of the domain."""
        return {Service.NODES: domain_ports.ranges(island)}

    def most_processes(self, island: Island) -> int | None:
        """Returns how many processes a domain has ports for, or nodes of other hosts look for."""
        return domain_ports.most_processes(self._distro, island)

    def debian_packages(self, requirement: str) -> tuple[str, ...]:
        """Returns the package of ROS's own archive, or that of Debian."""
        return ament_packages.debian_packages(self._distro, requirement)

    def package_source(self, platform: str) -> str:
        """Returns the archive of ROS, which has packages for Ubuntu."""
        return "packages.ros.org" if platform.startswith("ubuntu-") else ""

    def packages_of_key(self, key: str, *, headers: bool) -> tuple[str, ...]:
        """Returns the package of ROS's own archive, which has its headers, and those of Debian."""
        return ament_packages.packages_of_key(self._distro, key)

    def install_hints(self, missing: Sequence[str]) -> Iterator[str]:
        """Debian packages of ROS's own archive, or the build of a workspace."""
        return ament_packages.install_hints(self._distro, tuple(missing))


HUMBLE: Middleware = Ros2("humble")
JAZZY: Middleware = Ros2("jazzy")
KILTED: Middleware = Ros2("kilted")
LYRICAL: Middleware = Ros2("lyrical")
