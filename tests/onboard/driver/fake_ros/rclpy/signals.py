"""As much of rclpy.signals as nodes touch."""

from enum import Enum


class SignalHandlerOptions(Enum):
    NO = 0
