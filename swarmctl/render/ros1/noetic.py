"""ROS 1 behind the ``Middleware`` protocol: a master per island, roslaunch, Debian packages of Noetic."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from swarmctl.render import driver_config, expected_nodes, program_parts, sketch
from swarmctl.render.bag_recorder import ROSBAG
from swarmctl.render.bundle import File, Part, required, workspace
from swarmctl.render.middleware import Capability, ExpectedDriver, ExpectedNode, Master, Middleware
from swarmctl.render.ros1 import debian_packages, delivered_packages, drivers, programs, release, rviz
from swarmctl.render.service_values import home
from swarmctl.render.topic_tool import TopicTool
from swarmctl.resources import HostModule, onboard
from swarmctl.spec.model import Spec
from swarmctl.swarm import names
from swarmctl.swarm.flow import Service
from swarmctl.swarm.ports import DRAWN, Listener, PortRange, master_loc
from swarmctl.swarm.resolved import Host, Island, Program, Robot, Swarm, SwarmctlDriver
from swarmctl.swarm.topics import DIAGNOSTICS, DIAGNOSTICS_TYPE

#: Topics without a namespace that ROS itself or every driver publishes.
TOPICS = {
    DIAGNOSTICS: DIAGNOSTICS_TYPE,
    "/clock": "rosgraph_msgs/Clock",
    "/rosout": "rosgraph_msgs/Log",
    "/rosout_agg": "rosgraph_msgs/Log",
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
}


class Noetic:
    """The middleware of ``ros: {distro: noetic}``."""

    capabilities: frozenset[Capability] = frozenset(
        {"master", "launched", "launch-xml", "catkin", "ros1-nodes", "node-hosts"}
    )
    settings = frozenset({"master_port", "workspace", "builders", "naming", "ipv6", "use_sim_time"})
    variables = frozenset({"ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE"})
    launcher = "roslaunch"
    topic_tool = TopicTool(("rostopic",), "rostopic")
    bag_recorder = ROSBAG
    multimaster = "fkie"
    shared_files = frozenset({release.ENVIRONMENT})  # ROS_MASTER_URI and how the islands join
    topics = TOPICS
    master_mb = 100  # a Python program; a driver takes 60, rosout is smaller
    probe = HostModule("swarm_onboard.ros1_probe.observe", onboard().parent)

    def robots(self, swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
        """Yields the environment, the master on a hub, and the drivers."""
        yield Part(
            files=(*release.files(swarm, host, island), *drivers.files(swarm, host)),
            requires=_requires(swarm, host, island),
            wants=sketch.wants(swarm, host),
        )
        if host.name == island.hub:
            yield release.master_unit(swarm, host, island)
        yield from drivers.units(swarm, host)

    def programs(self, swarm: Swarm, host: Host) -> Iterator[Part]:
        """Yields the programs with a launch file or a script each."""
        yield Part(
            files=tuple(programs.files(swarm, host)),
            requires=program_parts.requires(swarm, host, debian_packages.ROSPY),
            secrets=tuple(program_parts.secret_forms(swarm, host)),
            secret_forms=program_parts.secret_forms(swarm, host),
            platform=delivered_packages.platform(swarm, host),
            unbuilt=delivered_packages.unbuilt(swarm, host),
        )
        yield from programs.units(swarm, host)

    def launch_files(self, swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
        """`setup.bash`, launch files of all drivers and of RViz, a script for each interactive program."""
        yield release.setup_script(swarm, host, island)
        if robots := swarm.robots_on(host.name):
            yield drivers.launch_file(swarm, robots)
        if host.name == island.hub:
            yield from rviz.files([one for name in island.hosts for one in swarm.robots_on(name)])
        yield from programs.terminal_scripts(swarm, host)

    def master(self, swarm: Swarm, island: Island) -> Master:
        """Returns the rosmaster of ``island``."""
        cleanup = f". {home(swarm)}/current/setup.bash; yes | rosnode cleanup"
        return Master(swarm.master_uri(island), names.unit(swarm.name, names.MASTER), cleanup)

    def discovery_servers(self, swarm: Swarm, island: Island) -> None:
        """Returns None: nodes ask the master."""

    def driver(self, swarm: Swarm, robot: Robot) -> ExpectedDriver:
        """Returns the driver's node, with one topic per reading."""
        return expected_nodes.driver(swarm, robot)

    def program(self, swarm: Swarm, program: Program) -> ExpectedNode:
        """Returns the program's node; one of a launch file has no known name."""
        return expected_nodes.program(swarm, program)

    def type_name(self, kind: str) -> str:
        """Returns the same: a spec has the names of ROS 1."""
        return kind

    def listeners(self, spec: Spec, island: Island, processes: Mapping[str, int]) -> Iterator[Listener]:
        """Yields the port of the master."""
        yield Listener(island.hub, island.master_port, "the ROS master", master_loc(spec, island))

    def ports(self, island: Island) -> Mapping[Service, Sequence[PortRange]]:
        """Returns the port of the master, and those of nodes, which are any."""
        port = island.master_port
        return {Service.MASTER: (PortRange("tcp", port, port),), Service.NODES: (DRAWN,)}

    def most_processes(self, island: Island) -> None:
        """Returns None: nodes take any free ports."""

    packages_of_key = staticmethod(debian_packages.packages_of_key)
    debian_packages = staticmethod(debian_packages.packages)

    def package_source(self, platform: str) -> str:
        """Returns the archive of ROS for Ubuntu 20.04; Debian 12 has ROS 1 itself."""
        return "packages.ros.org" if platform.startswith("ubuntu-20.04-") else ""

    def install_hints(self, missing: Sequence[str]) -> Iterator[str]:
        """Debian packages, or the build of a workspace."""
        packages: list[str] = []
        for kind, name in map(required, missing):
            if kind == "package":
                packages.append(f"ros-noetic-{name.replace('_', '-')}")
            elif kind == "workspace":
                yield f"`cd {name} && catkin_make` on the host, or correct `ros.workspace` or the host's"
            else:
                ubuntu, *debian = debian_packages.PROGRAMS[name]
                other = f" (Ubuntu 20.04) or `apt install {debian[0]}` (Debian)" if debian else ""
                yield f"`apt install {ubuntu}`{other}"
        if packages:
            apt = f"`apt install {' '.join(packages)}`"
            yield f"{apt}, or build it in the workspace that `ros.workspace` names"
        if any(one.startswith("ros-noetic-fkie") for one in packages):
            yield "or `multimaster: {provider: static}` in the spec: swarmctl's bridge needs no package"


NOETIC: Middleware = Noetic()


def _requires(swarm: Swarm, host: Host, island: Island) -> dict[str, tuple[str, ...]]:
    """What must be installed on this host already, and for whom."""
    robots = swarm.robots_on(host.name)
    driven = tuple(f"robots.{robot.name}" for robot in robots if isinstance(robot.driver, SwarmctlDriver))
    gated = tuple(f"robots.{robot.name}" for robot in robots if robot.gated)
    started = tuple(f"robots.{robot.name}" for robot in robots if driver_config.publishes_start(robot))
    needs = {
        debian_packages.ROSCORE: ("ros",) if host.name == island.hub else (),
        debian_packages.ROSPY: (*driven, *gated),
        debian_packages.PYSERIAL: driven,
        debian_packages.TF: started,
        **program_parts.needs_of_drivers(swarm, host),
    }
    own = "ros.workspace" if host.workspaces == (swarm.workspace,) else f"hosts.{host.name}.workspaces"
    needs = {**{workspace(path): (own,) for path in host.workspaces}, **needs}
    return {name: entries for name, entries in needs.items() if entries}
