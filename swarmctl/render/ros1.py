"""The ROS 1 part of a host's release: environment, parameters, launch files, units."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from swarmctl.render import firmware, rosserial, shipped
from swarmctl.render.bundle import ROOT, File, Unit, workspace
from swarmctl.render.params import params_file
from swarmctl.render.templates import render
from swarmctl.spec.params import params_of
from swarmctl.spec.tuning import watchdog_of
from swarmctl.topology import names
from swarmctl.topology.address import ip_of
from swarmctl.topology.swarm import Commander, Host, Island, RfcommLine, Robot, Swarm

_DEBIAN_PACKAGES = ("/usr/share", "/usr/lib")
ENVIRONMENT = "env/ros.env"
_MASTER_HELPERS = ("bin/wait-for-address", "bin/wait-for-master")
RUNNING = (ENVIRONMENT, "env/python_logging.conf", "bin/ros-exec")  # what every ROS program runs in
ROS_CLIENT = "bin/ros-client"


def files(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """Every file that ROS on this host needs, the units aside."""
    environment = _environment(swarm, host, island)
    yield File(ENVIRONMENT, render("ros.env", **environment), origin=f"hosts.{host.name}")
    yield File("setup.bash", render("setup.bash", **environment), origin=f"hosts.{host.name}")
    yield File("env/python_logging.conf", shipped.text("host/python_logging.conf"))
    yield File("bin/ros-exec", shipped.text("host/ros-exec"), 0o755)
    if host.name == island.hub:
        for program in _MASTER_HELPERS:
            yield File(program, shipped.text(program.replace("bin/", "host/")), 0o755)
    robots = swarm.robots_on(host.name)
    if not all(robot.foreign_sketch for robot in robots):
        yield from shipped.folder("drivers")
    if any(robot.foreign_sketch for robot in robots):
        yield ros_client()
    if robots:
        yield File(
            "launch/swarm.launch",
            render("swarm.launch", home=_home(swarm), robots=[one.name for one in robots]),
            origin="robots",
        )
    for robot in robots:
        yield from _robot_files(swarm, robot)


def _robot_files(swarm: Swarm, robot: Robot) -> Iterator[File]:
    """What the driver of one robot is told."""
    yield from firmware.files(robot)
    if robot.foreign_sketch is not None:
        yield rosserial.launch_file(robot)
        return
    yield File(_params_path(robot), parameters(robot), origin=f"robots.{robot.name}")
    if robot.codec:
        yield File(_codec_path(robot), robot.codec, origin=f"types.{robot.type_name}")
    launch = render(
        "robot.launch",
        group=robot.namespace[1:],
        node=names.DRIVER_NODE,
        home=_home(swarm),
        robot=robot.name,
    )
    yield File(_launch_path(robot), launch, origin=f"robots.{robot.name}")


def units(swarm: Swarm, host: Host, island: Island) -> Iterator[tuple[File, Unit]]:
    """The unit files of this host in start order: the master first, then what each robot needs."""
    common = service_values(swarm)
    master = names.unit(swarm.name, names.MASTER)
    if host.name == island.hub:
        uri = swarm.master_uri(island)
        text = render(
            "master.service",
            **common,
            island=island.name,
            port=island.master_port,
            address=host.address,
            uri=uri,
            runtime=names.runtime_folder(swarm.name, names.MASTER),
        )
        file = File(f"units/{master}", text, origin="ros")
        yield file, Unit(master, (file.path, ENVIRONMENT, "bin/ros-exec", *_MASTER_HELPERS))
    for robot in swarm.robots_on(host.name):
        bound = isinstance(robot.line, RfcommLine)
        line = names.unit(swarm.name, robot.name, "rfcomm") if bound else ""
        yield _driver(swarm, robot, line, common)


def ros_client() -> File:
    """What runs programs that cannot tell by themselves that their master has started anew."""
    return File(ROS_CLIENT, shipped.text("host/ros-client"), 0o755)


def service_values(swarm: Swarm) -> dict[str, Any]:
    """What the unit of every program of this swarm is told."""
    return {
        "swarm": swarm.name,
        "home": _home(swarm),
        "target": names.target(swarm.name),
        "workspace": swarm.workspace,
    }


def requires(swarm: Swarm, host: Host, island: Island) -> tuple[str, ...]:
    """What must be installed on this host already."""
    own = (workspace(swarm.workspace),) if swarm.workspace else ()
    master = ("roscore",) if host.name == island.hub else ()
    foreign = [robot.foreign_sketch for robot in swarm.robots_on(host.name)]
    drivers = ("rospy", "pyserial") if not all(foreign) else ()
    boards = (rosserial.PACKAGE,) if any(foreign) else ()
    return (*own, *master, *drivers, *boards)


def parameters(robot: Robot) -> bytes:
    """What a robot's driver reads, as YAML."""
    data = params_of(
        robot.type, robot=robot.name, namespace=robot.namespace, port=robot.line.path,
        settings=robot.settings, baud=robot.baud, module=f"../{_codec_path(robot)}",
    )  # fmt: skip
    if (made := firmware.sketch_of(robot)) is not None:
        data["protocol"] |= {"digest": made.digest}
    data["commanders"] = [_commander(one) for one in robot.commanders]
    return params_file(data)


def _commander(commander: Commander) -> dict[str, Any]:
    return {
        "name": commander.name,
        "priority": commander.priority,
        "nodes": list(commander.nodes),
        "namespace": commander.namespace,
        "addresses": list(commander.addresses),
    }


def _driver(swarm: Swarm, robot: Robot, line: str, common: dict[str, Any]) -> tuple[File, Unit]:
    name = names.unit(swarm.name, robot.name)
    values = {
        **common,
        "robot": robot.name,
        "title": robot.type.title,
        "line": line,
        "runtime": names.runtime_folder(swarm.name, robot.name),
    }
    if robot.foreign_sketch is not None:
        file = rosserial.unit_file(swarm.name, robot, robot.foreign_sketch, values)
        return file, Unit(name, (file.path, *RUNNING, ROS_CLIENT, _launch_path(robot)), robot=robot.name)
    text = render(
        "driver.service", **values, namespace=robot.namespace, node=names.DRIVER_NODE,
        watchdog=f"{watchdog_of(robot.type, robot.baud or robot.type.link.baud, robot.settings):.3g}",
    )  # fmt: skip
    file = File(f"units/{name}", text, origin=f"robots.{robot.name}")
    drivers = tuple(one.path for one in shipped.folder("drivers"))
    codec = (_codec_path(robot),) if robot.codec else ()
    needs = (file.path, *RUNNING, _params_path(robot), *codec, *drivers)
    return file, Unit(name, needs, robot=robot.name)


def _environment(swarm: Swarm, host: Host, island: Island) -> dict[str, Any]:
    return {
        "swarm": swarm.name,
        "distro": swarm.distro,
        "home": _home(swarm),
        "workspace": swarm.workspace,
        "master_uri": swarm.master_uri(island),
        "self_key": "ROS_IP" if ip_of(host.advertised) else "ROS_HOSTNAME",
        "advertised": host.advertised,
        "package_path": ":".join((f"{_home(swarm)}/current/drivers", *_DEBIAN_PACKAGES)),
    }


def _home(swarm: Swarm) -> str:
    return f"{ROOT}/{swarm.name}"


def _launch_path(robot: Robot) -> str:
    return f"launch/{robot.name}.launch"


def _params_path(robot: Robot) -> str:
    return f"params/{robot.name}.yaml"


def _codec_path(robot: Robot) -> str:
    return f"codecs/{robot.type_name}.py"
