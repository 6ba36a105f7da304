"""As much of rclpy.subscription as nodes touch: that of Kilted, which gives GIDs."""

from __future__ import annotations

from typing import Any, TypedDict


class MessageInfo(TypedDict):
    publisher_gid: dict[str, Any]
