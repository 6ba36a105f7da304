"""A zero of each command type as ROS serialises it, for a program that does without rospy."""

from __future__ import annotations

import struct
import time

#: Of the definitions of geometry_msgs.
MD5 = {
    "geometry_msgs/Twist": "9f195f881246fdfa2798d1d3eebca84a",
    "geometry_msgs/TwistStamped": "98d34b0043a2093cf9d9345ab6eef12e",
}
_ZEROS = bytes(6 * 8)  # six float64


def zero(kind: str) -> bytes:
    """Returns a message of type ``kind`` with all velocities 0, and the time of now where it has a stamp."""
    if kind == "geometry_msgs/Twist":
        return _ZEROS
    seconds, nanoseconds = divmod(time.time_ns(), 10**9)
    return struct.pack("<IIII", 0, seconds, nanoseconds, 0) + _ZEROS  # seq, stamp, an empty frame
