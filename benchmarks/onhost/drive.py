"""Commands to many robots as a joystick gives them, ten times a second: ``drive.py NAMESPACE=M/S ...``.

Each line on stdin is a factor by which all go from now on; the moment at which it was first sent is printed.
"""

from __future__ import annotations

import sys
import threading
import time

import rospy
from geometry_msgs.msg import Twist

RATE = 10.0  # Hz


def main() -> None:
    rospy.init_node("drive")
    wanted = dict(argument.split("=") for argument in rospy.myargv()[1:])
    speeds = {
        rospy.Publisher(f"{name}/cmd_vel", Twist, queue_size=1): float(speed)
        for name, speed in wanted.items()
    }
    factor, changed = [0.0], threading.Event()

    def read() -> None:
        for line in sys.stdin:
            factor[0] = float(line)
            changed.set()
        rospy.signal_shutdown("the input has ended")

    threading.Thread(target=read, daemon=True).start()
    while not rospy.is_shutdown():
        fresh = changed.wait(1 / RATE)
        changed.clear()
        if fresh:
            print(time.monotonic(), flush=True)
        for publisher, speed in speeds.items():
            command = Twist()
            command.linear.x = factor[0] * speed
            publisher.publish(command)


if __name__ == "__main__":
    main()
