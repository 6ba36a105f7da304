"""A robot's URDF: base, body, wheels and the places of its sensors, as far as its type knows them. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.render.quoting import render, xml
from swarmctl.swarm.topics import WHEEL_JOINTS

_FLAT = 0.02  # m; the height of a body of which nothing is known
_NAMELESS = b'<robot name="">'
Place = tuple[float, float, float, float]


def urdf(robot: str, model: bytes) -> bytes:
    """Returns the URDF of a robot: the ``model`` that it shares with others, and its name."""
    return model.replace(_NAMELESS, f"<robot name={xml(robot)}>".encode(), 1)


def model_of(params: Mapping[str, Any]) -> bytes:
    """Returns the URDF, without a name, of the robots whose drivers read ``params``, in m and rad.

    Its origin is the middle of the wheels' axis; link and joint names are without the robot's name, as
    `robot_state_publisher` and RViz expect them beside a `tf_prefix`.
    """
    kinematics, places = params["kinematics"], list(_places(params["sensors"]))
    radius, half = kinematics.get("wheel_radius"), kinematics["wheel_separation"] / 2
    return render(
        "robot.urdf",
        robot="",
        sensors=places,
        body_radius=round(max([half, *(math.hypot(x, y) for x, y, _, _ in places)]), 4),
        height=round(max([2 * radius if radius else _FLAT, *(place[2] for place in places)]), 4),
        wheel_radius=radius,
        wheels=tuple(zip(WHEEL_JOINTS, (half, -half), strict=True)) if radius else (),
    )


def _places(sensors: Mapping[str, Any]) -> Iterator[Place]:
    """Yields x, y, z and the heading of every distance sensor and camera, on or off."""
    for sensor in sensors.values():
        for one in sensor.get("elements", ()):
            yield one["x"], one["y"], one["z"], round(math.radians(one["heading_deg"]), 4)
        if sensor["kind"] == "image":
            yield sensor["x"], sensor["y"], sensor["z"], 0.0
