"""The drivers of a host's robots: launch files, configuration, units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from swarmctl.render import shipped_files, sketch
from swarmctl.render.bundle import File, Unit
from swarmctl.render.driver_config import codec_path, parameters, params_path
from swarmctl.render.quoting import render
from swarmctl.render.ros1 import rosserial_python
from swarmctl.render.ros1.release import ROS_CLIENT, RUNNING, home, ros_client, service_values
from swarmctl.robot_types.effective_settings import watchdog_of
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, RfcommLine, Robot, Swarm


def files(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields what the drivers of ``host`` need, their units aside."""
    robots = swarm.robots_on(host.name)
    if not all(robot.foreign_sketch for robot in robots):
        yield from shipped_files.folder("drivers")
    if any(robot.foreign_sketch for robot in robots):
        yield ros_client()
    for robot in robots:
        yield from _robot_files(swarm, robot)


def launch_file(swarm: Swarm, robots: Sequence[Robot]) -> File:
    """Returns the launch file with which people start all drivers of a host."""
    text = render("swarm.launch", home=home(swarm), robots=[one.name for one in robots])
    return File("launch/swarm.launch", text, origin="robots")


def units(swarm: Swarm, host: Host) -> Iterator[tuple[File, Unit]]:
    """Yields the units of the drivers, in the order of the spec."""
    common = service_values(swarm)
    for robot in swarm.robots_on(host.name):
        bound = isinstance(robot.line, RfcommLine)
        line = names.unit(swarm.name, robot.name, "rfcomm") if bound else ""
        yield _unit(swarm, robot, line, common)


def _robot_files(swarm: Swarm, robot: Robot) -> Iterator[File]:
    """The sketch, the launch file and the configuration of one robot."""
    yield from sketch.files(robot)
    if robot.foreign_sketch is not None:
        yield rosserial_python.launch_file(robot)
        return
    yield File(params_path(robot), parameters(robot), origin=f"robots.{robot.name}")
    if robot.codec:
        yield File(codec_path(robot), robot.codec, origin=f"types.{robot.type_name}")
    launch = render(
        "robot.launch",
        group=robot.namespace[1:],
        node=names.DRIVER_NODE,
        home=home(swarm),
        robot=robot.name,
    )
    yield File(_launch_path(robot), launch, origin=f"robots.{robot.name}")


def _unit(swarm: Swarm, robot: Robot, line: str, common: dict[str, Any]) -> tuple[File, Unit]:
    name = names.unit(swarm.name, robot.name)
    values = {
        **common,
        "robot": robot.name,
        "title": robot.type.title,
        "line": line,
        "runtime": names.runtime_folder(swarm.name, robot.name),
    }
    if robot.foreign_sketch is not None:
        file = rosserial_python.unit_file(swarm.name, robot, robot.foreign_sketch, values)
        return file, Unit(name, (file.path, *RUNNING, ROS_CLIENT, _launch_path(robot)), robot=robot.name)
    text = render(
        "driver.service", **values, namespace=robot.namespace, node=names.DRIVER_NODE,
        watchdog=f"{watchdog_of(robot.type, robot.baud or robot.type.link.baud, robot.settings):.3g}",
    )  # fmt: skip
    file = File(f"units/{name}", text, origin=f"robots.{robot.name}")
    drivers = tuple(one.path for one in shipped_files.folder("drivers"))
    codec = (codec_path(robot),) if robot.codec else ()
    needs = (file.path, *RUNNING, params_path(robot), *codec, *drivers)
    return file, Unit(name, needs, robot=robot.name)


def _launch_path(robot: Robot) -> str:
    return f"launch/{robot.name}.launch"
