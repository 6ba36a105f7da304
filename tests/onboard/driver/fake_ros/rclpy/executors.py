"""As much of rclpy.executors as nodes touch."""

from rclpy import Executor as SingleThreadedExecutor


class ExternalShutdownException(Exception):  # noqa: N818  its name in rclpy
    """Somebody else shut the context down."""


__all__ = ["ExternalShutdownException", "SingleThreadedExecutor"]
