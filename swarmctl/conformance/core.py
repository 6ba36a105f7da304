"""What the driver of one robot on the bench is told, and its port: as on a host, but in no swarm."""

from __future__ import annotations

from swarm_driver.config import Config, parse
from swarm_driver.own import InterruptionError
from swarm_driver.port import Port, PortError

from swarmctl.spec.params import params_of
from swarmctl.spec.robot_type import RobotType


class TooLongError(InterruptionError):
    """A protocol's class does not come back. Not an Exception, so that the class cannot catch it."""


class BreakOffError(InterruptionError):
    """Somebody ends the test by a signal."""


def config_for(robot_type: RobotType, name: str, port: str, baud: int | None, module: str) -> Config:
    """What the driver of such a robot is told; nobody commands it."""
    params = params_of(robot_type, robot=name, namespace=f"/{name}", port=port, baud=baud, module=module)
    return parse({**params, "commanders": []})


def open_port(config: Config) -> Port:
    """The serial port, for nobody else. ``PortError`` says why not."""
    return Port(config.port, config.serial)


__all__ = ["BreakOffError", "Port", "PortError", "TooLongError", "config_for", "open_port"]
