"""The parameters of the gate in front of a robot's ROS package."""

from __future__ import annotations

from typing import Any

from swarm_onboard.agent.paths import stop_file

from swarmctl.render.bundle import File
from swarmctl.render.driver_config import commander_params
from swarmctl.render.yaml_params import params_file
from swarmctl.swarm import names
from swarmctl.swarm.resolve import power_topics
from swarmctl.swarm.resolved import ForeignDriver, Robot, Swarm

RATE = 10.0  # Hz at which the velocity in force is repeated: a driver's own dead-man is longer than 0.1 s
REPORTS = 1.0  # Hz
FOLDER = "gate"


def file(swarm: Swarm, robot: Robot, driver: ForeignDriver) -> File:
    """Returns the file that the gate of ``robot`` reads."""
    values = {**parameters(robot, driver), "stop_file": stop_file(swarm.name, robot.name)}
    return File(params_path(robot), params_file(values), origin=f"robots.{robot.name}")


def parameters(robot: Robot, driver: ForeignDriver) -> dict[str, Any]:
    """Returns what the gate of ``robot`` reads."""
    linear, lateral, vertical, angular = driver.motion.axes
    motion = {
        "kind": driver.motion.kind,
        "linear_max": linear,
        "lateral_max": lateral,
        "vertical_max": vertical,
        "angular_max": angular,
        "wheel_separation": driver.motion.wheel_separation,
        "turning_radius": driver.motion.turning_radius,
    }
    odometry = next((one.name for one in robot.topics if one.type == "nav_msgs/Odometry"), "")
    battery, docked = power_topics(robot.topics)
    read = {"odometry": odometry, "battery": battery, "docked": docked}
    return {
        "robot": robot.name,
        "title": robot.type.title,
        "namespace": robot.namespace,
        "command_type": robot.command_type,
        "output_type": driver.ros.command_type,
        "command_timeout": driver.command_timeout,
        "rate": RATE,
        "diagnostics_rate": REPORTS,
        "commanders": [commander_params(one) for one in robot.commanders],
        "motion": {key: value for key, value in motion.items() if value},
        "odom_frame": driver.ros.odometry_frame,
        **{key: robot.full_name(topic) for key, topic in read.items() if topic},
        **({"battery_limits": limits.model_dump()} if (limits := robot.settings.battery) else {}),
        **({"start": robot.start.model_dump()} if robot.start is not None else {}),
    }


def launch_name(robot: Robot) -> str:
    """Returns the name of the launch file with which people start the gate, without its suffix."""
    return f"{robot.name}.{names.GATE_NODE}"


def params_path(robot: Robot) -> str:
    """Returns where the parameters of a robot's gate are in a release."""
    return f"params/{launch_name(robot)}.yaml"
