"""The configuration of a driver under test: as on a host, but without a swarm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from swarm_onboard.driver.config import Config, parse

from swarmctl.robot_types.driver_params import params_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import RobotSettings, merged


def config_for(robot_type: RobotType, name: str, port: str, baud: int | None, module: str) -> Config:
    """Returns the driver configuration of a robot type, without commanders."""
    params = params_of(
        robot_type, robot=name, namespace=f"/{name}", port=port, baud=baud, module=module,
        settings=_with_tuned_sensors(robot_type),
    )  # fmt: skip
    return parse({**params, "commanders": []})


def config_of(params: Mapping[str, Any], port: str, baud: int | None, module: str) -> Config:
    """Returns the driver configuration of a robot of a swarm, with another port and without commanders."""
    serial = {**params["serial"], **({"baud": baud} if baud else {})}
    protocol = {**params["protocol"], **({"module": module} if "module" in params["protocol"] else {})}
    return parse({**params, "port": port, "serial": serial, "protocol": protocol, "commanders": []})


def _with_tuned_sensors(robot_type: RobotType) -> RobotSettings:
    """Returns the type's settings with every sensor on that has settings of its own: off, it is not set."""
    rates = {name: 1.0 for name, one in robot_type.sensors.items() if one.settings_key}
    return merged(robot_type.settings, RobotSettings(rates=rates))
