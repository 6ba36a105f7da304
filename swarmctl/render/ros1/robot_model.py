"""A robot's URDF: base, body, wheels and the places of its sensors, as far as its type knows them. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from swarmctl.render.quoting import render, xml
from swarmctl.swarm.topics import WHEEL_JOINTS

_FLAT = 0.02  # m; the height of a body of which nothing is known
Place = tuple[float, float, float, float]


def urdf(params: Mapping[str, Any]) -> bytes:
    """Returns the URDF of the robot whose driver reads ``params``, in m and rad.

    Its origin is the middle of the wheels' axis; link and joint names are without the robot's name, as
    `robot_state_publisher` and RViz expect them beside a `tf_prefix`.
    """
    kinematics, places = params["kinematics"], list(_places(params["sensors"]))
    radius, half = kinematics.get("wheel_radius"), kinematics["wheel_separation"] / 2
    shape = _Shape(
        sensors=tuple(places),
        body_radius=round(max([half, *(math.hypot(x, y) for x, y, _, _ in places)]), 4),
        height=round(max([2 * radius if radius else _FLAT, *(place[2] for place in places)]), 4),
        wheel_radius=radius,
        wheels=tuple(zip(WHEEL_JOINTS, (half, -half), strict=True)) if radius else (),
    )
    named = f"<robot name={xml(params['robot'])}>"
    return _nameless(shape).replace(b'<robot name="">', named.encode(), 1)


@dataclass(frozen=True)
class _Shape:
    """All values of the template but the name, in m and rad: robots of one shape share the rest."""

    sensors: tuple[Place, ...]
    body_radius: float
    height: float
    wheel_radius: float | None
    wheels: tuple[tuple[str, float], ...]


@lru_cache(maxsize=1024)
def _nameless(shape: _Shape) -> bytes:
    return render("robot.urdf", robot="", **vars(shape))


def _places(sensors: Mapping[str, Any]) -> Iterator[Place]:
    """Yields x, y, z and the heading of every distance sensor and camera, on or off."""
    for sensor in sensors.values():
        for one in sensor.get("elements", ()):
            yield one["x"], one["y"], one["z"], round(math.radians(one["heading_deg"]), 4)
        if sensor["kind"] == "image":
            yield sensor["x"], sensor["y"], sensor["z"], 0.0
