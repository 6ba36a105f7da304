"""Transforms as ROS messages, and the one from `map` to a robot's odometry frame."""

from __future__ import annotations

import math
from typing import Any, Tuple

from geometry_msgs.msg import Quaternion, TransformStamped, Vector3

from swarm_onboard.command.start import Start

Place = Tuple[float, float, float]
MAP = "map"  # of the whole swarm, as in REP 105

TFMessage: Any
try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # a host without tf gets no transforms
    TFMessage = None


def transform(parent: str, child: str, place: Place, rotation: Any, stamp: Any) -> Any:
    """Returns a TransformStamped; ``place`` in m, ``rotation`` a Quaternion."""
    message = TransformStamped(child_frame_id=child)
    message.header.stamp = stamp
    message.header.frame_id = parent
    x, y, z = place
    message.transform.translation = Vector3(x=x, y=y, z=z)
    message.transform.rotation = rotation
    return message


def turned_by(yaw: float) -> Any:
    """Returns the Quaternion of a rotation around z, in rad."""
    return Quaternion(x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def start_is_lost(start: Start | None) -> bool:
    """Returns True if there is a start pose that this host cannot publish."""
    return start is not None and TFMessage is None


def start_transform(start: Start, odom: str, stamp: Any) -> Any:
    """Returns the TransformStamped from `map` to the odometry frame ``odom``, which begins at ``start``."""
    return transform(MAP, odom, (start.x, start.y, 0.0), turned_by(start.yaw), stamp)
