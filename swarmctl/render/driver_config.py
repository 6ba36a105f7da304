"""The configuration file of a robot's driver."""

from __future__ import annotations

from typing import Any

from swarmctl.render import sketch
from swarmctl.render.yaml_params import params_file
from swarmctl.robot_types.driver_params import params_of
from swarmctl.swarm.resolved import Commander, Robot


def parameters(robot: Robot) -> bytes:
    """Returns what the driver of ``robot`` reads, as YAML."""
    data = params_of(
        robot.type, robot=robot.name, namespace=robot.namespace, port=robot.line.path,
        settings=robot.settings, baud=robot.baud, module=f"../{codec_path(robot)}",
    )  # fmt: skip
    if (made := sketch.sketch_of(robot)) is not None:
        data["protocol"] |= {"digest": made.digest}
    data["commanders"] = [_commander(one) for one in robot.commanders]
    return params_file(data)


def params_path(robot: Robot) -> str:
    """Returns its path in the release."""
    return f"params/{robot.name}.yaml"


def codec_path(robot: Robot) -> str:
    """Returns the path in the release of the file with the protocol class of the robot's type."""
    return f"codecs/{robot.type_name}.py"


def _commander(commander: Commander) -> dict[str, Any]:
    return {
        "name": commander.name,
        "priority": commander.priority,
        "nodes": list(commander.nodes),
        "namespace": commander.namespace,
        "addresses": list(commander.addresses),
    }
