"""What a driver shows as ROS parameters: what the spec and the robot type gave it. Pure."""

from __future__ import annotations

from typing import Any, Mapping


def shown_params(data: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the parameters of a node, in SI units; it does not read them. ``data``: its parameter file."""
    kinematics, prefix = data["kinematics"], data["frame_prefix"]
    shown = ("wheel_separation", "wheel_speed_max", "wheel_radius")
    return {
        "robot": data["robot"],
        "title": data["title"],
        "port": data["port"],
        "baud": data["serial"]["baud"],
        "command_timeout": data["command_timeout"],
        "commanders": {one["name"]: one["priority"] for one in data["commanders"]},
        "limits": {"linear": kinematics["linear_max"], "angular": kinematics["angular_max"]},
        "kinematics": {name: kinematics[name] for name in shown if name in kinematics},
        "frames": {"odom": f"{prefix}odom", "base": f"{prefix}base_link"},
        "rates": {name: sensor["rate"] for name, sensor in data["sensors"].items()},
    }
