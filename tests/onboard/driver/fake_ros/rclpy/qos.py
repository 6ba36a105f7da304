"""As much of rclpy.qos as nodes touch."""

from __future__ import annotations

from enum import Enum


class ReliabilityPolicy(Enum):
    BEST_EFFORT = 2
    RELIABLE = 1


class DurabilityPolicy(Enum):
    TRANSIENT_LOCAL = 1


class QoSProfile:
    def __init__(self, *, depth: int) -> None:
        self.depth = depth
