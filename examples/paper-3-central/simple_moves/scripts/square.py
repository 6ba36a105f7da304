#!/usr/bin/env python3
"""Drive along a square, again and again, by the clock: forward for one side, then a quarter turn to the left.

Publishes `cmd_vel` (geometry_msgs/Twist). When this program ends, the driver stops the robot.
"""

import contextlib
import math

import rospy
from geometry_msgs.msg import Twist

RATE = 10.0  # Hz; a driver waits 0.5 s for the next command


def main() -> None:
    rospy.init_node("square")
    speed = rospy.get_param("~speed", 0.05)  # m/s
    side = rospy.get_param("~side", 0.3)  # m
    turn = rospy.get_param("~turn", 0.5)  # rad/s
    commands = rospy.Publisher("cmd_vel", Twist, queue_size=1)
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        for linear, angular, seconds in ((speed, 0.0, side / speed), (0.0, turn, math.pi / 2 / turn)):
            command = Twist()
            command.linear.x, command.angular.z = linear, angular
            end = rospy.get_time() + seconds
            while rospy.get_time() < end and not rospy.is_shutdown():
                commands.publish(command)
                rate.sleep()


if __name__ == "__main__":
    with contextlib.suppress(rospy.ROSInterruptException):
        main()
