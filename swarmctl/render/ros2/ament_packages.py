"""Which ROS packages hosts need, and which Debian packages of ROS's own archive bring them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from swarmctl.render import driver_config, program_parts
from swarmctl.render.bundle import package, required, workspace
from swarmctl.render.ros2.graph_environment import IMPLEMENTATIONS
from swarmctl.spec.ros_model import SERVED
from swarmctl.swarm.resolved import ForeignDriver, Host, Island, Program, Robot, Swarm, SwarmctlDriver

RCLPY, PYSERIAL = package("rclpy"), "pyserial"
#: What is no ROS package, by the name of the requirement.
PROGRAMS = {PYSERIAL: ("python3-serial",)}
_OF_FASTDDS = {"humble": "fastrtps", "jazzy": "fastrtps"}  # before Kilted
_NAME = re.compile(r"[a-z0-9][a-z0-9.+-]+")


def requires(swarm: Swarm, host: Host, island: Island) -> Mapping[str, tuple[str, ...]]:
    """Returns what must be installed on ``host`` for its robots and its server, and for whom."""
    robots, discovery = swarm.robots_on(host.name), island.discovery
    driven = tuple(f"robots.{robot.name}" for robot in robots if isinstance(robot.driver, SwarmctlDriver))
    gated = tuple(f"robots.{robot.name}" for robot in robots if robot.gated)
    started = tuple(f"robots.{robot.name}" for robot in robots if driver_config.publishes_start(robot))
    launched = tuple(f"robots.{robot.name}" for robot in robots if _launches(robot))
    own = "ros.workspace" if host.workspaces == (swarm.workspace,) else f"hosts.{host.name}.workspaces"
    served = discovery.method in SERVED and host.name in discovery.servers
    needs = {
        **{workspace(path): (own,) for path in host.workspaces},
        package(IMPLEMENTATIONS[discovery.rmw]): ("ros",),
        package(_OF_FASTDDS.get(island.distro, "fastdds")): (
            ("ros",) if served and discovery.method == "server" else ()
        ),
        RCLPY: (*driven, *gated),
        PYSERIAL: driven,
        package("tf2_msgs"): started,
        package("ros2launch"): launched,
        **program_parts.needs_of_drivers(swarm, host),
    }
    return {name: entries for name, entries in needs.items() if entries}


def of_programs(swarm: Swarm, host: Host) -> Mapping[str, tuple[str, ...]]:
    """Returns the same for the programs of ``host``."""
    found = program_parts.requires(swarm, host, RCLPY)
    launched = tuple(f"programs.{one.name}" for one in swarm.programs_on(host.name) if _is_launched(one))
    return {**found, **({package("ros2launch"): launched} if launched else {})}


def _launches(robot: Robot) -> bool:
    return isinstance(robot.driver, ForeignDriver) and robot.driver.ros.launch is not None


def _is_launched(program: Program) -> bool:
    return program.declared.launch is not None and not program.declared.optional


def debian_packages(distro: str, requirement: str) -> tuple[str, ...]:
    """Returns the package of ROS's own archive, or that of Debian."""
    kind, name = required(requirement)
    return (f"ros-{distro}-{name.replace('_', '-')}",) if kind == "package" else PROGRAMS.get(name, ())


def packages_of_key(distro: str, key: str) -> tuple[str, ...]:
    """Returns the package of ROS's own archive, and those of Debian."""
    dashed = key.replace("_", "-").lower()
    plain = (dashed,) if "-" in key else ()
    return tuple(
        one for one in (f"ros-{distro}-{dashed}", f"python3-{dashed}", *plain) if _NAME.fullmatch(one)
    )


def install_hints(distro: str, missing: tuple[str, ...]) -> Iterator[str]:
    """Yields what to do on a host that lacks ``missing``."""
    names: list[str] = []
    for one in missing:
        kind, name = required(one)
        if kind == "workspace":
            yield f"`cd {name} && colcon build` on the host, or correct `ros.workspace` or the host's"
        else:
            names += debian_packages(distro, one)[:1]
    if names:
        yield f"`apt install {' '.join(names)}`, with packages.ros.org among its sources"
