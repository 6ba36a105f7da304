"""The least that a node with a driver's topics costs: ``bare.py NAMESPACE ODOM_HZ READINGS_HZ``.

It publishes and subscribes as a driver does, and drives nothing.
"""

from __future__ import annotations

import os
import sys
import time

os.environ["ROS_NAMESPACE"] = sys.argv[1]

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import UInt16MultiArray
from tf2_msgs.msg import TFMessage


def main() -> None:
    rospy.init_node("bare", disable_signals=True)
    odom = rospy.Publisher("odom", Odometry, queue_size=1)
    tf = rospy.Publisher("/tf", TFMessage, queue_size=1)
    readings = rospy.Publisher("proximity", UInt16MultiArray, queue_size=1)
    diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
    rospy.Subscriber("cmd_vel", Twist, lambda _command: None, queue_size=1, tcp_nodelay=True)
    status = DiagnosticStatus(values=[KeyValue(str(number), "") for number in range(20)])

    def move() -> None:
        odom.publish(Odometry())
        tf.publish(TFMessage([TransformStamped()]))

    tasks = (
        (1 / float(sys.argv[2]), move),
        (1 / float(sys.argv[3]), lambda: readings.publish(UInt16MultiArray(data=[0] * 16))),
        (1.0, lambda: diagnostics.publish(DiagnosticArray(status=[status]))),
    )
    due = [time.monotonic()] * len(tasks)
    while True:
        for number, (period, publish) in enumerate(tasks):
            if due[number] <= time.monotonic():
                due[number] += period
                publish()
        time.sleep(max(0.0, min(due) - time.monotonic()))


if __name__ == "__main__":
    main()
