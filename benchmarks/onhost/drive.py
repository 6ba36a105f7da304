"""Commands to many robots as a joystick gives them, at 10 Hz: ``drive.py NAMESPACE=M/S ... [__name:=NODE]``.

Each line on stdin is a factor by which all go from now on; the moment at which it was first sent is printed.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Twist

RATE = 10.0  # Hz


def join(name: str) -> Callable[[str], Any]:
    """Becomes a node. Returns what makes the publisher of a topic."""
    if os.environ.get("ROS_VERSION") == "2":
        import rclpy

        rclpy.init()
        node = rclpy.create_node(name)
        return lambda topic: node.create_publisher(Twist, topic, 1)
    import rospy

    rospy.init_node(name)
    return lambda topic: rospy.Publisher(topic, Twist, queue_size=1)


def main() -> None:
    names = [one.split(":=")[1] for one in sys.argv[1:] if ":=" in one]
    publisher_of = join(names[0] if names else "drive")
    pairs = (one.split("=") for one in sys.argv[1:] if ":=" not in one)
    speeds = {publisher_of(f"{name}/cmd_vel"): float(speed) for name, speed in pairs}
    factor, changed, ended = [0.0], threading.Event(), threading.Event()

    def read() -> None:
        for line in sys.stdin:
            factor[0] = float(line)
            changed.set()
        ended.set()

    threading.Thread(target=read, daemon=True).start()
    while not ended.is_set():
        if changed.wait(1 / RATE):
            changed.clear()
            print(time.monotonic(), flush=True)
        for publisher, speed in speeds.items():
            command = Twist()
            command.linear.x = factor[0] * speed
            publisher.publish(command)


if __name__ == "__main__":
    main()
