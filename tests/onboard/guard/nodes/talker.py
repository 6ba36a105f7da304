"""Publishes its own name on a topic, 20 times a second: ``talker.py NAME TOPIC``."""

from __future__ import annotations

import sys

import rospy
from std_msgs.msg import String

rospy.names._set_caller_id(sys.argv[1])
rospy.init_node(sys.argv[1].rpartition("/")[2], disable_signals=True)
rospy.set_param("/k3/talks", True)
publisher = rospy.Publisher(sys.argv[2], String, queue_size=1)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    publisher.publish(sys.argv[1])
    rate.sleep()
