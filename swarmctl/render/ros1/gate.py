"""The gate in front of a robot's ROS package: its parameters, launch file and unit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from swarmctl.render import gate_config, shipped_files
from swarmctl.render.bundle import File, Part, Unit
from swarmctl.render.quoting import render
from swarmctl.render.ros1.release import FACE, RUNNING, arguments
from swarmctl.render.service_values import home
from swarmctl.swarm import names
from swarmctl.swarm.resolved import ForeignDriver, Robot, Swarm


def files(swarm: Swarm, robot: Robot, driver: ForeignDriver) -> Iterator[File]:
    """Yields the parameters of a robot's gate, and its launch file for people."""
    origin = f"robots.{robot.name}"
    yield gate_config.file(swarm, robot, driver)
    text = render(
        "gate.launch",
        group=robot.namespace[1:],
        node=names.GATE_NODE,
        home=home(swarm),
        params=gate_config.params_path(robot),
        by_hand=[names.unit(swarm.name, robot.name, names.GATE_NODE)],
        own="",
    )
    yield File(f"launch/{gate_config.launch_name(robot)}.launch", text, origin=origin)


def unit(swarm: Swarm, robot: Robot, common: dict[str, Any]) -> Part:
    """Returns the unit of a robot's gate; it starts before that of the driver."""
    name = names.unit(swarm.name, robot.name, names.GATE_NODE)
    values = {
        **common,
        "driver": names.unit(swarm.name, robot.name),
        "params": gate_config.params_path(robot),
        "words": arguments(robot.namespace, names.GATE_NODE),
        "runtime": names.runtime_folder(swarm.name, gate_config.launch_name(robot)),
    }
    file = File(f"units/{name}", render("gate.service", **values), origin=f"robots.{robot.name}")
    shipped = tuple(one.path for one in shipped_files.folder(gate_config.FOLDER, FACE))
    return Part(
        (file,),
        (Unit(name, (file.path, *RUNNING, gate_config.params_path(robot), *shipped), robot=robot.name),),
    )
