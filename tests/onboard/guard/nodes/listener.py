"""Prints what comes on a topic, with its sender and the address of that: ``listener.py NAME TOPIC``."""

from __future__ import annotations

import json
import os
import sys

import rospy
from std_msgs.msg import String


def show(message: String) -> None:
    os.write(1, (json.dumps({"received": message.data}) + "\n").encode())


rospy.names._set_caller_id(sys.argv[1])
rospy.init_node(sys.argv[1].rpartition("/")[2], disable_signals=True)
rospy.Subscriber(sys.argv[2], String, show)
rospy.spin()
