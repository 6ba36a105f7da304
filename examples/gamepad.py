#!/usr/bin/env python3
"""A gamepad for a lab without one: publishes what is typed as `joy_node` would, twenty times a second.

Type how far the stick is pushed forward and to the left, from -1 to 1, such as `1 0`: the dead-man button is
then held. Anything else lets go of it. Needs ROS 1 or ROS 2, and runs where the gamepad would be connected.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from sensor_msgs.msg import Joy

RATE = 20.0  # Hz
AXES, BUTTONS = 8, 11  # of a common gamepad
LEFTWARD, FORWARD = 0, 1  # its axes
DEADMAN = 4  # its button


def pad(line: str) -> tuple[bool, float, float]:
    """Whether the button is held, and how far the stick is forward and to the left."""
    with contextlib.suppress(ValueError):
        forward, left = (float(word) for word in line.split())
        return True, forward, left
    return False, 0.0, 0.0


def join() -> tuple[Callable[[Any], None], Callable[[], Any]]:
    """Becomes a node. Returns how it publishes a message, and what time it is for a header."""
    if os.environ.get("ROS_VERSION") == "2":
        import rclpy  # noqa: PLC0415

        rclpy.init()
        node = rclpy.create_node("gamepad")
        return node.create_publisher(Joy, "joy", 1).publish, lambda: node.get_clock().now().to_msg()
    import rospy  # noqa: PLC0415

    rospy.init_node("gamepad", disable_signals=True)
    return rospy.Publisher("joy", Joy, queue_size=1).publish, rospy.Time.now


def main() -> None:
    state, ended = [pad("")], threading.Event()

    def read() -> None:
        for line in sys.stdin:
            state[0] = pad(line)
        ended.set()

    publish, now = join()
    threading.Thread(target=read, daemon=True).start()
    while not ended.is_set():
        held, forward, left = state[0]
        joy = Joy(axes=[0.0] * AXES, buttons=[0] * BUTTONS)
        joy.header.stamp = now()
        joy.axes[FORWARD], joy.axes[LEFTWARD], joy.buttons[DEADMAN] = forward, left, int(held)
        publish(joy)
        time.sleep(1 / RATE)


if __name__ == "__main__":
    main()
