#!/usr/bin/env python3
"""Drive along a square, again and again, by the clock: forward for one side, then a quarter turn to the left.

Publishes `cmd_vel` (geometry_msgs/Twist). When this program ends, the driver stops the robot.
"""

import contextlib
import math
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import ExternalShutdownException

RATE = 10.0  # Hz; a driver waits 0.5 s for the next command


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("square")
    speed = node.declare_parameter("speed", 0.05).value  # m/s
    side = node.declare_parameter("side", 0.3).value  # m
    turn = node.declare_parameter("turn", 0.5).value  # rad/s
    commands = node.create_publisher(Twist, "cmd_vel", 1)
    while True:
        for linear, angular, seconds in ((speed, 0.0, side / speed), (0.0, turn, math.pi / 2 / turn)):
            command = Twist()
            command.linear.x, command.angular.z = linear, angular
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                commands.publish(command)
                rclpy.spin_once(node, timeout_sec=1 / RATE)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        main()
