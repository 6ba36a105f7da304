"""As much of rclpy.parameter as nodes touch."""

from __future__ import annotations

from typing import Any


class Parameter:
    def __init__(self, name: str, *, value: Any) -> None:
        self.name, self.value = name, value
