"""A vendor's driver without a dead-man: its robot does for ever what came last. ``robot.py NAMESPACE TOPIC``.

Prints each command with the moment of its arrival, and each status of the gate.
"""

from __future__ import annotations

import json
import os
import sys
import time

os.environ["ROS_NAMESPACE"] = sys.argv[1]

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist


def show(**line: object) -> None:
    """In one piece: each connection has a thread of its own."""
    os.write(1, (json.dumps({"t": time.monotonic(), **line}) + "\n").encode())


def commanded(twist: Twist) -> None:
    components = (
        twist.linear.x,
        twist.linear.y,
        twist.linear.z,
        twist.angular.x,
        twist.angular.y,
        twist.angular.z,
    )
    show(by=twist._connection_header["callerid"], v=components)


def reported(message: DiagnosticArray) -> None:
    for status in message.status:
        values = {one.key: one.value for one in status.values}
        level = ord(status.level) if isinstance(status.level, bytes) else status.level
        show(level=level, message=status.message, values=values)


rospy.init_node("driver", disable_signals=True)
rospy.Subscriber(sys.argv[2], Twist, commanded, tcp_nodelay=True)
rospy.Subscriber("/diagnostics", DiagnosticArray, reported)
time.sleep(1e6)
