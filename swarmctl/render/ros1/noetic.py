"""ROS 1 behind the ``Middleware`` protocol: a master per island, roslaunch, Debian packages of Noetic."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarmctl.render import sketch
from swarmctl.render.bundle import File, required, workspace
from swarmctl.render.middleware import ExpectedDriver, ExpectedNode, Master, Middleware
from swarmctl.render.part import Part
from swarmctl.render.ros1 import drivers, graph, programs, release, rosserial_python
from swarmctl.resources import HostModule, templates
from swarmctl.spec.model import Spec
from swarmctl.swarm import names
from swarmctl.swarm.ports import Listener, master_loc
from swarmctl.swarm.resolved import Host, Island, Program, Robot, Swarm

_ROSCORE, _ROSPY, _PYSERIAL = "roscore", "rospy", "pyserial"
_INSTALL = {
    _ROSCORE: "`apt install ros-noetic-ros-base` (Ubuntu 20.04) or `apt install python3-roslaunch` (Debian)",
    _ROSPY: "`apt install ros-noetic-ros-base` (Ubuntu 20.04) or `apt install python3-rospy` (Debian)",
    _PYSERIAL: "`apt install python3-serial`",
}


class Noetic:
    """The middleware of ``ros: {distro: noetic}``."""

    ros1 = True
    topics = graph.TOPICS
    master_mb = 100  # a Python program; a driver takes 60, rosout is smaller
    probe = HostModule("swarm_ros1_probe.observe", templates() / "packages/ros1_probe")

    def robots(self, swarm: Swarm, host: Host, island: Island) -> Part:
        """Returns the environment, the master on a hub, and the drivers."""
        master = [release.master_unit(swarm, host, island)] if host.name == island.hub else []
        return Part(
            files=(*release.files(swarm, host, island), *drivers.files(swarm, host)),
            units=(*master, *drivers.units(swarm, host)),
            requires=_requires(swarm, host, island),
            wants=sketch.wants(swarm, host),
        )

    def programs(self, swarm: Swarm, host: Host) -> Part:
        """Returns the programs with a launch file or a script each."""
        return Part(
            files=tuple(programs.files(swarm, host)),
            units=tuple(programs.units(swarm, host)),
            requires=programs.requires(swarm, host),
        )

    def launch_files(self, swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
        """`setup.bash`, a launch file of all drivers, a script for each interactive program."""
        yield release.setup_script(swarm, host, island)
        if robots := swarm.robots_on(host.name):
            yield drivers.launch_file(swarm, robots)
        yield from programs.terminal_scripts(swarm, host)

    def master(self, swarm: Swarm, island: Island) -> Master:
        """Returns the rosmaster of ``island``."""
        return Master(swarm.master_uri(island), names.unit(swarm.name, names.MASTER))

    def driver(self, swarm: Swarm, robot: Robot) -> ExpectedDriver:
        """Returns the driver's node, with one topic per reading."""
        return graph.driver(swarm, robot)

    def program(self, swarm: Swarm, program: Program) -> ExpectedNode:
        """Returns the program's node; one of a launch file has no known name."""
        return graph.program(swarm, program)

    def type_name(self, kind: str) -> str:
        """Returns the same: a spec has the names of ROS 1."""
        return kind

    def listeners(self, spec: Spec, island: Island) -> Iterator[Listener]:
        """Yields the port of the master."""
        yield Listener(island.hub, island.master_port, "the ROS master", master_loc(spec, island))

    def install_hints(self, missing: Sequence[str]) -> Iterator[str]:
        """Debian packages, or the build of a workspace."""
        packages: list[str] = []
        for kind, name in map(required, missing):
            if kind == "package":
                packages.append(f"ros-noetic-{name.replace('_', '-')}")
            elif kind == "workspace":
                yield f"`cd {name} && catkin_make` on the host, or correct `ros.workspace`"
            else:
                yield _INSTALL[name]
        if packages:
            apt = f"`apt install {' '.join(packages)}`"
            yield f"{apt}, or build it in the workspace that `ros.workspace` names"


NOETIC: Middleware = Noetic()


def _requires(swarm: Swarm, host: Host, island: Island) -> tuple[str, ...]:
    """What must be installed on this host already."""
    own = (workspace(swarm.workspace),) if swarm.workspace else ()
    master = (_ROSCORE,) if host.name == island.hub else ()
    foreign = [robot.foreign_sketch for robot in swarm.robots_on(host.name)]
    driver = (_ROSPY, _PYSERIAL) if not all(foreign) else ()
    boards = (rosserial_python.PACKAGE,) if any(foreign) else ()
    return (*own, *master, *driver, *boards)
