#!/usr/bin/env python3
"""Drive every robot of a group in a circle until this program ends.

Publishes `/<robot>/cmd_vel` (geometry_msgs/Twist) for `~count` robots. Their namespaces are `~robots` with
their numbers: tb3_%02d is tb3_01, tb3_02 and so on. When it ends, each robot stops after its command_timeout.
"""

import contextlib

import rospy
from geometry_msgs.msg import Twist

RATE = 10.0  # Hz; a robot waits 0.5 s for the next command


def main() -> None:
    rospy.init_node("circle")
    command = Twist()
    command.linear.x = rospy.get_param("~linear")  # m/s
    command.angular.z = rospy.get_param("~angular")  # rad/s
    names = [rospy.get_param("~robots") % number for number in range(1, rospy.get_param("~count") + 1)]
    publishers = [rospy.Publisher(f"/{name}/cmd_vel", Twist, queue_size=1) for name in names]
    rate = rospy.Rate(RATE)
    while not rospy.is_shutdown():
        for publisher in publishers:
            publisher.publish(command)
        rate.sleep()


if __name__ == "__main__":
    with contextlib.suppress(rospy.ROSInterruptException):
        main()
