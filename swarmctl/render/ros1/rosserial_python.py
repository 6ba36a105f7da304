"""The driver of a robot whose board speaks rosserial: the ROS package `rosserial_python`, as its unit."""

from __future__ import annotations

from typing import Any

from swarmctl.render.bundle import File, package
from swarmctl.render.quoting import render
from swarmctl.robot_types.protocols import RosserialProtocol
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Robot

PACKAGE = package("rosserial_python")


def launch_file(robot: Robot) -> File:
    """Returns the launch file with its port, for the unit and for people."""
    text = render(
        "rosserial.launch",
        group=robot.namespace[1:],
        node=names.DRIVER_NODE,
        port=robot.line.path,
        baud=robot.baud or robot.type.link.baud,
    )
    return File(f"launch/{robot.name}.launch", text, origin=f"robots.{robot.name}")


def unit_file(swarm: str, robot: Robot, sketch: RosserialProtocol, common: dict[str, Any]) -> File:
    """Returns the unit. It does not stop the motors when it ends: the sketch does."""
    text = render("rosserial.service", **common, firmware_timeout=sketch.firmware_timeout)
    return File(f"units/{names.unit(swarm, robot.name)}", text, origin=f"robots.{robot.name}")
