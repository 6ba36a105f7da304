"""The true state of a stand-in, for the lab: a JSON file that is replaced as a whole."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from swarm_onboard.stand_in.body import Body

NAME = "stand_in.json"


def truth(body: Body, wheel_separation: float) -> dict[str, Any]:
    """Returns pose (m, rad) and velocity (m/s, rad/s) as `lab robots` shows them."""
    forward, aside, up, turn = body.velocity
    half = wheel_separation / 2
    return {
        "x": body.pose.x,
        "y": body.pose.y,
        "z": body.pose.z,
        "theta": body.pose.theta,
        "left": forward - turn * half,
        "right": forward + turn * half,
        "v": (forward**2 + aside**2 + up**2) ** 0.5,
        "omega": turn,
        "distance": body.pose.distance,
        "commands": body.commands,
    }


def write(folder: Path, state: dict[str, Any]) -> None:
    """Replaces the file in ``folder``. Raises ``OSError``."""
    fresh = folder / (NAME + ".new")
    fresh.write_text(json.dumps(state))
    fresh.replace(folder / NAME)
