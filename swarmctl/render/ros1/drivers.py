"""The drivers of a host's robots: launch files, configuration, units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from swarmctl.links.bluetooth_link import RfcommLine
from swarmctl.render import driver_config, gate_config, shipped_files, sketch
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.driver_config import codec_path, params_path, urdf_path
from swarmctl.render.quoting import render
from swarmctl.render.ros1 import foreign_drivers, gate
from swarmctl.render.ros1.release import FACE, RUNNING, arguments, ros_client
from swarmctl.render.service_values import home, service_values
from swarmctl.swarm import names
from swarmctl.swarm.resolved import ForeignDriver, Host, Robot, Swarm, SwarmctlDriver


def files(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields what the drivers of ``host`` need, their units aside."""
    robots = swarm.robots_on(host.name)
    foreign = [isinstance(robot.driver, ForeignDriver) for robot in robots]
    if not all(foreign):
        yield from shipped_files.folder("drivers", FACE)
    if any(foreign):
        yield ros_client()
    if any(robot.gated for robot in robots):
        yield from shipped_files.folder(gate_config.FOLDER, FACE)
    for robot in robots:
        yield from sketch.files(robot)
        if isinstance(robot.driver, ForeignDriver):
            yield from foreign_drivers.files(swarm, robot, robot.driver)
            if robot.driver.gated:
                yield from gate.files(swarm, robot, robot.driver)
        else:
            yield from _own_files(swarm, robot, robot.driver)


def launch_file(swarm: Swarm, robots: Sequence[Robot]) -> File:
    """Returns the launch file with which people start all drivers of a host."""
    gated = [one for one in robots if one.gated]
    units = [names.unit(swarm.name, one.name, names.GATE_NODE) for one in gated]
    text = render(
        "swarm.launch",
        home=home(swarm),
        names=[*(gate_config.launch_name(one) for one in gated), *(one.name for one in robots)],
        by_hand=[*units, *(names.unit(swarm.name, one.name) for one in robots)],
        own="",
    )
    return File("launch/swarm.launch", text, origin="robots")


def units(swarm: Swarm, host: Host) -> Iterator[Part]:
    """Yields the units of the drivers, in the order of the spec."""
    for robot in swarm.robots_on(host.name):
        bound = isinstance(robot.line, RfcommLine)
        values = {
            **service_values(swarm, host),
            "robot": robot.name,
            "title": robot.type.title,
            "line": names.unit(swarm.name, robot.name, "rfcomm") if bound else "",
            "runtime": names.runtime_folder(swarm.name, robot.name),
        }
        if isinstance(robot.driver, ForeignDriver):
            if robot.driver.gated:
                yield gate.unit(swarm, robot, values)
            yield foreign_drivers.unit(swarm, host, robot, robot.driver, values)
        else:
            yield _own_unit(swarm, robot, robot.driver, values)


def _own_files(swarm: Swarm, robot: Robot, driver: SwarmctlDriver) -> Iterator[File]:
    """The launch file and the configuration of swarmctl's driver."""
    yield from driver_config.config_files(swarm, robot, driver)
    launch = render(
        "robot.launch",
        group=robot.namespace[1:],
        node=names.DRIVER_NODE,
        home=home(swarm),
        robot=robot.name,
        by_hand=[names.unit(swarm.name, robot.name)],
        own="",
    )
    yield File(foreign_drivers.launch_path(robot), launch, origin=f"robots.{robot.name}")


def _own_unit(swarm: Swarm, robot: Robot, driver: SwarmctlDriver, values: dict[str, Any]) -> Part:
    name = names.unit(swarm.name, robot.name)
    text = render(
        "driver.service", **values, words=arguments(robot.namespace, names.DRIVER_NODE),
        watchdog=driver_config.watchdog(robot, driver),
    )  # fmt: skip
    file = File(f"units/{name}", text, origin=f"robots.{robot.name}")
    drivers = tuple(one.path for one in shipped_files.folder("drivers", FACE))
    codec = (codec_path(robot),) if driver.codec else ()
    needs = (file.path, *RUNNING, params_path(robot), urdf_path(robot), *codec, *drivers)
    return Part((file,), (Unit(name, needs, robot=robot.name),))
