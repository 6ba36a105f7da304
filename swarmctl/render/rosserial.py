"""The driver of a robot whose board speaks rosserial: the ROS package `rosserial_python`, as its unit."""

from __future__ import annotations

from typing import Any

from swarmctl.render.bundle import File, package
from swarmctl.render.templates import render
from swarmctl.spec.protocols import RosserialProtocol
from swarmctl.topology import names
from swarmctl.topology.swarm import Robot

PACKAGE = package("rosserial_python")


def launch_file(robot: Robot) -> File:
    """Where its port is, for the unit and for people."""
    text = render(
        "rosserial.launch",
        group=robot.namespace[1:],
        node=names.DRIVER_NODE,
        port=robot.line.path,
        baud=robot.baud or robot.type.link.baud,
    )
    return File(f"launch/{robot.name}.launch", text, origin=f"robots.{robot.name}")


def unit_file(swarm: str, robot: Robot, sketch: RosserialProtocol, common: dict[str, Any]) -> File:
    """The unit. Nothing stops the motors with it: that is the sketch's part."""
    text = render("rosserial.service", **common, firmware_timeout=sketch.firmware_timeout)
    return File(f"units/{names.unit(swarm, robot.name)}", text, origin=f"robots.{robot.name}")
