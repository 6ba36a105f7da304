#!/usr/bin/env python3
"""A gamepad for a lab without one: says what is typed as `joy_node` would, twenty times a second.

Type how far the stick is pushed forward and to the left, from -1 to 1, such as `1 0`: the dead-man button is
then held. Anything else lets go of it. Needs ROS, and runs where the gamepad would hang.
"""

from __future__ import annotations

import contextlib
import sys
import threading

import rospy
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


def main() -> None:
    rospy.init_node("gamepad")
    publisher = rospy.Publisher("joy", Joy, queue_size=1)
    state = [pad("")]

    def read() -> None:
        for line in sys.stdin:
            state[0] = pad(line)
        rospy.signal_shutdown("the input has ended")

    threading.Thread(target=read, daemon=True).start()
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        held, forward, left = state[0]
        joy = Joy(axes=[0.0] * AXES, buttons=[0] * BUTTONS)
        joy.header.stamp = rospy.Time.now()
        joy.axes[FORWARD], joy.axes[LEFTWARD], joy.buttons[DEADMAN] = forward, left, int(held)
        publisher.publish(joy)
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            return


if __name__ == "__main__":
    main()
