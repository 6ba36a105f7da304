"""Robots of the field: their public dimensions, from manuals, data sheets and ROS packages."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class FieldRobot:
    """Lengths in m, speed in m/s, counts for one turn of a wheel."""

    name: str
    separation: float
    radius: float | None
    speed: float
    counts: float | None = None


FIELD = (
    FieldRobot("TurtleBot 1 (Create)", 0.26, 0.033, 0.5, 508.8),
    FieldRobot("TurtleBot 2 (Kobuki)", 0.23, 0.035, 0.65, 2578.33),
    FieldRobot("TurtleBot3 Burger", 0.16, 0.033, 0.22, 4096),
    FieldRobot("TurtleBot3 Waffle", 0.287, 0.033, 0.26, 4096),
    FieldRobot("TurtleBot 4 (Create 3)", 0.233, 0.03575, 0.46, 508.8),
    FieldRobot("Husky A200", 0.5708, 0.1651, 1.0, 80_900),
    FieldRobot("Jackal", 0.37559, 0.098, 2.0),
    FieldRobot("Warthog", 1.1369, 0.3, 5.0),
    FieldRobot("Thymio II", 0.094, 0.022, 0.2),
    FieldRobot("Kilobot", 0.025, None, 0.01),
    FieldRobot("e-puck", 0.053, 0.0205, 0.1288, 1000),
    FieldRobot("Koala", 0.29, 0.0425, 0.45, 5934),
    FieldRobot("Khepera III", 0.08841, 0.0205, 0.298, 4198.4),
    FieldRobot("Khepera IV", 0.1054, 0.021, 0.814, 19_456),
    FieldRobot("Pioneer 3-DX", 0.381, 0.0975, 1.2, 76_600),
    FieldRobot("Pioneer 3-AT", 0.394, 0.111, 0.7, 34_000),
    FieldRobot("iRobot Create 2", 0.235, 0.036, 0.5, 508.8),
    FieldRobot("Duckiebot DB21", 0.1, 0.0318, 0.5, 135),
    FieldRobot("a kit with an UNO", 0.13, 0.0325, 0.5, 20),
)


def as_type(robot: FieldRobot, **changed: float) -> dict[str, Any]:
    """The data of a robot type; ``changed`` are factors by key."""
    kinematics: dict[str, Any] = {
        "wheel_separation": robot.separation * changed.get("wheel_separation", 1),
        "wheel_speed_max": robot.speed * changed.get("wheel_speed_max", 1),
    }
    scale = {"speed_units_per_mps": 1000.0 if robot.speed > 0.1 else 10_000.0, "metres_per_count": 0.001}
    sensors: dict[str, Any] = {}
    if robot.radius is not None:
        kinematics["wheel_radius"] = robot.radius * changed.get("wheel_radius", 1)
    if robot.counts is not None and robot.radius is not None:
        way = 2 * math.pi * robot.radius / robot.counts
        scale["metres_per_count"] = way * changed.get("metres_per_count", 1)
        sensors["odom"] = {"kind": "wheels", "read": "position"}
    queries = {}
    if "odom" in sensors:
        queries["position"] = {"send": "P", "reply": "p", "values": 2}
    return {
        "title": robot.name,
        "link": {"kinds": ["serial"], "baud": 115200},
        "kinematics": {**kinematics, "scales": [scale]},
        "protocol": {
            "kind": "line",
            "set_speed": {"send": "D,{left},{right}", "reply": "d"},
            "queries": queries,
        },
        "sensors": sensors,
        "firmware_dead_man": True,
    }
