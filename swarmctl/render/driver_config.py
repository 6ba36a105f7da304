"""The configuration file of a robot's driver."""

from __future__ import annotations

from typing import Any

from swarmctl.render import sketch
from swarmctl.render.yaml_params import params_file
from swarmctl.robot_types.driver_params import params_of
from swarmctl.swarm.resolved import Commander, Robot, SwarmctlDriver


def parameters(robot: Robot, driver: SwarmctlDriver) -> bytes:
    """Returns what swarmctl's driver of ``robot`` reads, as YAML."""
    data = type_params(robot, driver) | {"urdf": f"../{urdf_path(robot)}"}
    if (made := sketch.sketch_of(robot)) is not None:
        data["protocol"] |= {"digest": made.digest}
    if robot.start is not None:
        data["start"] = robot.start.model_dump()
    data["commanders"] = [commander_params(one) for one in robot.commanders]
    return params_file(data)


def type_params(robot: Robot, driver: SwarmctlDriver) -> dict[str, Any]:
    """Returns what follows from the type and the settings of ``robot``."""
    return params_of(
        driver.type, robot=robot.name, namespace=robot.namespace, port=driver.line.path,
        settings=robot.settings, baud=driver.baud, module=f"../{codec_path(robot)}",
    )  # fmt: skip


def params_path(robot: Robot) -> str:
    """Returns its path in the release."""
    return f"params/{robot.name}.yaml"


def urdf_path(robot: Robot) -> str:
    """Returns the path in the release of the robot's URDF."""
    return f"urdf/{robot.name}.urdf"


def codec_path(robot: Robot) -> str:
    """Returns the path in the release of the file with the protocol class of the robot's type."""
    return f"codecs/{robot.type_name}.py"


def commander_params(commander: Commander) -> dict[str, Any]:
    """Returns an entry of `commanders`, as driver and gate read it."""
    return {
        "name": commander.name,
        "priority": commander.priority,
        "nodes": list(commander.nodes),
        "namespace": commander.namespace,
        "addresses": list(commander.addresses),
    }
