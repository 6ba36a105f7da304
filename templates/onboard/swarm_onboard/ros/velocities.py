"""Commands as messages: a Twist, or a TwistStamped, which says when it was a command."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Twist, TwistStamped

VELOCITIES = {"geometry_msgs/Twist": Twist, "geometry_msgs/TwistStamped": TwistStamped}


def twist_and_stamp(message: Any) -> tuple[Any, Any]:
    """Returns the Twist of a command, and its stamp; None where its type has none."""
    if isinstance(message, TwistStamped):
        return message.twist, message.header.stamp
    return message, None
