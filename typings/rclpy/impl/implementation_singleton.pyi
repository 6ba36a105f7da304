from typing import Any

rclpy_implementation: Any
