"""Publishes one command 20 times a second: ``sender.py NAME TOPIC LINEAR ANGULAR [RATE [THEN...]]``.

With a rate of 0 it latches the command and publishes it again after 0.5 s, since a gate leaves out what may
have been latched before it connected. After 2 s it goes on with ``THEN`` as linear speed, each for 0.5 s,
and prints the moment at which it begins to.
"""

from __future__ import annotations

import itertools
import json
import os
import sys
import time

import rospy
from geometry_msgs.msg import Twist

NAMESPACE, _, NAME = sys.argv[1].rpartition("/")
RATE = float(sys.argv[5]) if len(sys.argv) > 5 else 20.0
rospy.names._set_caller_id(sys.argv[1])
rospy.init_node(NAME, disable_signals=True)
publisher = rospy.Publisher(sys.argv[2], Twist, queue_size=1, tcp_nodelay=True, latch=not RATE)
command = Twist()
command.linear.x, command.angular.z = float(sys.argv[3]), float(sys.argv[4])
pauses = itertools.repeat(1 / RATE) if RATE else iter((0.5, 1e6))


def publish(seconds: float) -> None:
    end = time.monotonic() + seconds
    while not rospy.is_shutdown() and time.monotonic() < end:
        publisher.publish(command)
        time.sleep(next(pauses))


publish(2.0 if sys.argv[6:] else 1e6)
os.write(1, (json.dumps({"t": time.monotonic()}) + "\n").encode())
for linear in sys.argv[6:]:
    command.linear.x = float(linear)
    publish(0.5)
