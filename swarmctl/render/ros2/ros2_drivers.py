"""The drivers of a host's robots and the gates in front of ROS packages: files and units."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from typing import Any

from swarmctl.links.bluetooth_link import RfcommLine
from swarmctl.render import driver_config, gate_config, shipped_files, sketch
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.driver_config import codec_path, params_path, remapped, urdf_path
from swarmctl.render.program_parts import with_environment
from swarmctl.render.quoting import render
from swarmctl.render.ros2 import enclaves
from swarmctl.render.ros2.node_words import node_params, remapping, ros_args
from swarmctl.render.ros2.ros2_release import FACE, RUN_NODE, run_node, running, unit_values
from swarmctl.render.service_values import home
from swarmctl.swarm import names
from swarmctl.swarm.resolved import ForeignDriver, Host, Island, Robot, Swarm, SwarmctlDriver

_DRIVERS = "drivers"


def files(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields what the drivers of ``host`` need, their units aside."""
    robots = swarm.robots_on(host.name)
    if any(isinstance(robot.driver, SwarmctlDriver) for robot in robots):
        yield from shipped_files.folder(_DRIVERS, FACE)
    if any(robot.gated for robot in robots):
        yield from shipped_files.folder(gate_config.FOLDER, FACE)
    for robot in robots:
        yield from sketch.files(robot)
        if isinstance(robot.driver, SwarmctlDriver):
            yield from driver_config.config_files(swarm, robot, robot.driver)
        else:
            yield from _package_files(robot, robot.driver)
            if robot.gated:
                yield gate_config.file(swarm, robot, robot.driver)


def launch_file(swarm: Swarm, host: Host) -> File:
    """Returns the launch file with which people start all drivers of a host."""
    commands, included = [], []
    for robot in swarm.robots_on(host.name):
        if robot.gated:
            commands.append(_gate_words(swarm, robot))
        if isinstance(robot.driver, SwarmctlDriver):
            commands.append(_own_words(swarm, robot))
        elif robot.driver.ros.launch is not None:
            included.append(f"{home(swarm)}/current/{_launch_path(robot)}")
        else:
            commands.append(_package_words(swarm, robot, robot.driver))
    text = render("ros2/swarm.launch.xml", commands=[shlex.join(one) for one in commands], files=included)
    return File("launch/swarm.launch.xml", text, origin="robots")


def units(swarm: Swarm, host: Host, island: Island) -> Iterator[Part]:
    """Yields the units of gates and drivers, in the order of the spec."""
    for robot in swarm.robots_on(host.name):
        bound = isinstance(robot.line, RfcommLine)
        values = {
            **unit_values(swarm, host, island),
            "robot": robot.name,
            "title": robot.type.title,
            "line": names.unit(swarm.name, robot.name, "rfcomm") if bound else "",
            "runtime": names.runtime_folder(swarm.name, robot.name),
        }
        needs = running(swarm, host, island)
        if robot.gated:
            yield _gate_unit(swarm, robot, values, needs)
        if isinstance(robot.driver, SwarmctlDriver):
            yield _own_unit(swarm, robot, robot.driver, values, needs)
        else:
            yield _package_unit(swarm, robot, robot.driver, {**values, "user": host.user}, needs)


def _own_words(swarm: Swarm, robot: Robot) -> tuple[str, ...]:
    current = f"{home(swarm)}/current"
    script = f"{current}/{_DRIVERS}/serial_driver.py"
    return "/usr/bin/python3", script, "--config", f"{current}/{params_path(robot)}"


def _gate_words(swarm: Swarm, robot: Robot) -> tuple[str, ...]:
    current = f"{home(swarm)}/current"
    script = f"{current}/{gate_config.FOLDER}/gate.py"
    return "/usr/bin/python3", script, "--config", f"{current}/{gate_config.params_path(robot)}"


def _own_unit(
    swarm: Swarm, robot: Robot, driver: SwarmctlDriver, values: dict[str, Any], needs: tuple[str, ...]
) -> Part:
    own = {"words": (), "watchdog": driver_config.watchdog(robot, driver)}
    shipped = (one.path for one in shipped_files.folder(_DRIVERS, FACE))
    codec = (codec_path(robot),) if driver.codec else ()
    read = (*needs, params_path(robot), urdf_path(robot), *codec, *shipped)
    return _unit(swarm, robot, "driver.service", {**values, **own}, read)


def _gate_unit(swarm: Swarm, robot: Robot, values: dict[str, Any], needs: tuple[str, ...]) -> Part:
    own = {
        "driver": names.unit(swarm.name, robot.name),
        "params": gate_config.params_path(robot),
        "words": (),
        "runtime": names.runtime_folder(swarm.name, gate_config.launch_name(robot)),
    }
    shipped = (one.path for one in shipped_files.folder(gate_config.FOLDER, FACE))
    read = (*needs, gate_config.params_path(robot), *shipped)
    return _unit(swarm, robot, "gate.service", {**values, **own}, read, names.GATE_NODE)


def _package_unit(
    swarm: Swarm, robot: Robot, driver: ForeignDriver, values: dict[str, Any], needs: tuple[str, ...]
) -> Part:
    command = _package_words(swarm, robot, driver)
    read = (*needs, RUN_NODE, *(one.path for one in _package_files(robot, driver)))
    return _unit(swarm, robot, "ros_driver.service", {**values, "command": command}, read)


def _unit(
    swarm: Swarm, robot: Robot, template: str, values: dict[str, Any], needs: tuple[str, ...], *part: str
) -> Part:
    enclave = enclaves.of_gate(swarm, robot) if part else enclaves.of_driver(swarm, robot)
    name = names.unit(swarm.name, robot.name, *part)
    text = render(template, **{**values, **enclaves.unit_values(swarm, enclave)})
    file = File(f"units/{name}", text, origin=f"robots.{robot.name}")
    read = (file.path, *needs, *enclaves.enclave_needs(swarm, enclave))
    return Part((file,), (Unit(name, read, robot=robot.name, secrets=enclaves.secrets_of(swarm, enclave)),))


def _package_words(swarm: Swarm, robot: Robot, driver: ForeignDriver) -> tuple[str, ...]:
    """The words that run the driver's own executable, or launch its launch file."""
    ros, current = driver.ros, f"{home(swarm)}/current"
    if ros.launch is not None or ros.package is None or ros.executable is None:
        return with_environment(ros.environment, ("ros2", "launch", f"{current}/{_launch_path(robot)}"))
    params = [f"{current}/{params_path(robot)}"] if ros.params else []
    arguments = ros_args(robot.driver_node, remapped(robot, driver), params)
    words = (*run_node(swarm, ros.package, ros.executable), *ros.words, *arguments)
    return with_environment(ros.environment, words)


def _package_files(robot: Robot, driver: ForeignDriver) -> Iterator[File]:
    ros, origin = driver.ros, f"robots.{robot.name}"
    if ros.launch is not None:
        text = render(
            "ros2/program.launch.xml",
            group=driver.ros.namespace_around(robot.namespace),
            package=ros.package,
            launch=ros.launch,
            arguments=list(ros.arguments.items()),
            remap=list(remapping(remapped(robot, driver)).items()),
            environment=list(ros.environment.items()),
        )
        yield File(_launch_path(robot), text, origin=origin)
    elif ros.params:
        yield File(params_path(robot), node_params(ros.params), origin=origin)


def _launch_path(robot: Robot) -> str:
    return f"launch/{robot.name}.launch.xml"
