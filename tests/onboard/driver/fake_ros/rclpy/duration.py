"""As much of rclpy.duration as nodes touch."""

from __future__ import annotations


class Duration:
    def __init__(self, *, seconds: float) -> None:
        self.seconds = seconds
