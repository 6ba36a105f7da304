from enum import Enum
from typing import Any

from rclpy.duration import Duration

class ReliabilityPolicy(Enum):
    BEST_EFFORT = ...
    RELIABLE = ...

class DurabilityPolicy(Enum):
    TRANSIENT_LOCAL = ...

class QoSProfile:
    reliability: ReliabilityPolicy
    durability: DurabilityPolicy
    lifespan: Duration
    def __init__(self, *, depth: int, reliability: ReliabilityPolicy = ...) -> None: ...
    def get_c_qos_profile(self) -> Any: ...
