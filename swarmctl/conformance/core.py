"""What the driver of one robot on the bench is told, and its port: as on a host, but in no swarm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from swarm_driver.config import Config, parse
from swarm_driver.port import Port, PortError

from swarmctl.spec.cameras import camera_of
from swarmctl.spec.params import params_of
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.settings import RobotSettings, merged


def config_for(robot_type: RobotType, name: str, port: str, baud: int | None, module: str) -> Config:
    """What the driver of such a robot is told; nobody commands it."""
    params = params_of(
        robot_type, robot=name, namespace=f"/{name}", port=port, baud=baud, module=module,
        settings=with_camera(robot_type),
    )  # fmt: skip
    return parse({**params, "commanders": []})


def config_of(params: Mapping[str, Any], port: str, baud: int | None, module: str) -> Config:
    """What the driver of one robot of a swarm is told, but for its port; nobody commands it."""
    serial = {**params["serial"], **({"baud": baud} if baud else {})}
    protocol = {**params["protocol"], **({"module": module} if "module" in params["protocol"] else {})}
    return parse({**params, "port": port, "serial": serial, "protocol": protocol, "commanders": []})


def with_camera(robot_type: RobotType) -> RobotSettings:
    """The type's settings with its camera on: one that is not set up has images of any size."""
    found = camera_of(robot_type.sensors)
    return merged(robot_type.settings, RobotSettings(rates={found[0]: 1.0} if found else {}))


def open_port(config: Config) -> Port:
    """The serial port, for nobody else. ``PortError`` says why not."""
    return Port(config.port, config.serial)


__all__ = ["Port", "PortError", "config_for", "config_of", "open_port"]
