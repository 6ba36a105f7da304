"""What ROS 1 on a host consists of: environment, master, helper scripts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.quoting import render
from swarmctl.render.ros1 import delivered_packages, guard_config
from swarmctl.render.service_values import home, service_values
from swarmctl.swarm import names
from swarmctl.swarm.addresses import ip_of
from swarmctl.swarm.resolved import Host, Island, Swarm, SwarmctlDriver

_DEBIAN_PACKAGES = ("/usr/share", "/usr/lib")
ENVIRONMENT = "env/ros.env"
WAIT = "bin/wait-for-address"
_MASTER_HELPERS = {
    WAIT: "os/wait-for-address",
    "bin/wait-for-master": "ros1/wait-for-master",
}
RESTART_DELAY = "bin/restart-delay"
#: What every ROS program runs in.
RUNNING = (ENVIRONMENT, "env/python_logging.conf", "bin/ros-exec", RESTART_DELAY)
ROS_CLIENT = "bin/ros-client"
FACE = "ros1"  # of `swarm_onboard`


def files(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """Yields what every ROS program on this host runs in; on a hub also what its master runs."""
    environment = _environment(swarm, host, island)
    yield File(ENVIRONMENT, render("ros.env", **environment), origin=f"hosts.{host.name}")
    yield File("env/python_logging.conf", shipped_files.text("ros1/python_logging.conf"))
    yield File("bin/ros-exec", shipped_files.text("ros1/ros-exec"), 0o755)
    yield File("bin/refuse-beside-units", shipped_files.text("ros1/refuse-beside-units"), 0o755)
    yield File(RESTART_DELAY, shipped_files.text("os/restart-delay"), 0o755)
    if host.name == island.hub:
        for program, text in _MASTER_HELPERS.items():
            yield File(program, shipped_files.text(text), 0o755)


def setup_script(swarm: Swarm, host: Host, island: Island) -> File:
    """Returns what people source at a terminal to use the ROS of the swarm."""
    text = render("setup.bash", **_environment(swarm, host, island))
    return File("setup.bash", text, origin=f"hosts.{host.name}")


def master_unit(swarm: Swarm, host: Host, island: Island) -> Part:
    """Returns the unit of the ROS master, and of its guard if it has one."""
    name, guard = names.unit(swarm.name, names.MASTER), guard_config.guard_of(swarm, island)
    text = render(
        "master.service",
        **service_values(swarm, host),
        island=island.name,
        port=island.master_port,
        address=host.ros_address,
        uri=swarm.master_uri(island),
        use_sim_time=swarm.use_sim_time,
        runtime=names.runtime_folder(swarm.name, names.MASTER),
        guard=guard.path,
        places=guard.places,
        user=host.user,
    )
    files = (File(f"units/{name}", text, origin="ros"), *guard.program)
    runs = (ENVIRONMENT, "bin/ros-exec", RESTART_DELAY, *_MASTER_HELPERS)
    # The guard reads other parameters while it runs: a robot that joins restarts no master.
    return Part((*files, *guard.read), (Unit(name, (*(file.path for file in files), *runs)),))


def ros_client() -> File:
    """Returns the script that restarts a program when its master restarts."""
    return File(ROS_CLIENT, shipped_files.text("ros1/ros-client"), 0o755)


def arguments(namespace: str, node: str) -> tuple[str, ...]:
    """Returns the arguments that name a node (wiki.ros.org/Remapping Arguments)."""
    return f"__ns:={namespace or '/'}", f"__name:={node}"


def as_client(swarm: Swarm, command: Iterable[str], *, forever: bool = False) -> tuple[str, ...]:
    """Returns ``command`` behind `ros-client`; ``forever``: it fails if the command ends by itself."""
    return f"{home(swarm)}/current/{ROS_CLIENT}", *(["--forever"] if forever else []), *command


def _environment(swarm: Swarm, host: Host, island: Island) -> dict[str, Any]:
    own = (*_own_packages(swarm, host), *delivered_packages.package_path(swarm, host))
    return {
        "swarm": swarm.name,
        "distro": swarm.distro_of(host.name),
        "home": home(swarm),
        "workspaces": host.workspaces,
        "master_uri": swarm.master_uri(island),
        "self_key": "ROS_IP" if ip_of(host.advertised) else "ROS_HOSTNAME",
        "advertised": host.advertised,
        "ipv6": swarm.ipv6,
        "use_sim_time": swarm.use_sim_time,
        "own_packages": "".join(f"{folder}:" for folder in own),
        "package_path": ":".join((*own, *_DEBIAN_PACKAGES)),
        "python_path": ":".join(delivered_packages.python_path(swarm, host)),
        "built": delivered_packages.space(swarm, host),
    }


def _own_packages(swarm: Swarm, host: Host) -> Iterator[str]:
    """Yields the folders with ROS packages of swarmctl that this host's release has."""
    if any(isinstance(robot.driver, SwarmctlDriver) for robot in swarm.robots_on(host.name)):
        yield f"{home(swarm)}/current/drivers"
    if any(robot.gated for robot in swarm.robots_on(host.name)):
        yield f"{home(swarm)}/current/gate"
