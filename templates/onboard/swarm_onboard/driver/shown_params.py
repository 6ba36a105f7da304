"""What a driver shows as ROS parameters: what the spec and the robot type gave it. Pure."""

from __future__ import annotations

from typing import Any

from swarm_onboard.driver.config import Config


def shown_params(config: Config) -> dict[str, Any]:
    """Returns the parameters of the node, in SI units; nothing reads them back."""
    kinematics = config.kinematics
    radius = {} if kinematics.wheel_radius is None else {"wheel_radius": kinematics.wheel_radius}
    return {
        "robot": config.robot,
        "title": config.title,
        "port": config.port,
        "baud": config.serial.baud,
        "command_timeout": config.command_timeout,
        "commanders": {one.name: one.priority for one in config.commanders},
        "limits": {"linear": kinematics.linear_max, "angular": kinematics.angular_max},
        "kinematics": {
            "wheel_separation": kinematics.wheel_separation,
            "wheel_speed_max": kinematics.wheel_speed_max,
            **radius,
        },
        "frames": {"odom": f"{config.frame_prefix}odom", "base": f"{config.frame_prefix}base_link"},
        "rates": {one.name: one.rate for one in config.sensors},
    }
