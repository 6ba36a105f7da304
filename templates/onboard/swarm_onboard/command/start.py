"""Where a robot stands when its driver starts. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Mapping


@dataclass(frozen=True)
class Start:
    """The robot's place in the frame `map` when its driver starts: m and rad."""

    x: float
    y: float
    yaw: float


def start_of(data: Mapping[str, Any]) -> Start:
    """Returns the value of `start`. Raises ``KeyError``, ``TypeError`` or ``ValueError``."""
    return Start(float(data["x"]), float(data["y"]), math.radians(float(data["heading_deg"])))
