"""As much of geometry_msgs as teleop touches."""

from __future__ import annotations

from types import SimpleNamespace


class Twist:
    def __init__(self) -> None:
        self.linear, self.angular = (SimpleNamespace(x=0.0, y=0.0, z=0.0) for _ in range(2))


class TwistStamped:
    def __init__(self) -> None:
        self.header, self.twist = SimpleNamespace(stamp=0.0), Twist()
