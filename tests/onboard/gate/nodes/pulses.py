"""Publishes numbered commands 20 times a second, on each topic in turn: ``pulses.py NAME COUNT TOPIC...``.

Prints the moment of each. The number is the speed in millionths of a m/s, which no gate slows.
"""

from __future__ import annotations

import json
import sys
import time

import rospy
from geometry_msgs.msg import Twist

RATE = 20.0  # Hz on each topic
TOPICS = sys.argv[3:]
rospy.init_node(sys.argv[1].lstrip("/"), disable_signals=True)
publishers = {topic: rospy.Publisher(topic, Twist, queue_size=1, tcp_nodelay=True) for topic in TOPICS}
while not all(one.get_num_connections() for one in publishers.values()):
    time.sleep(0.05)
time.sleep(1.0)
for number in range(1, int(sys.argv[2]) + 1):
    for topic, publisher in publishers.items():
        command = Twist()
        command.linear.x = number * 1e-6
        print(json.dumps({"t": time.monotonic(), "n": number, "topic": topic}))
        publisher.publish(command)
        time.sleep(1 / RATE / len(publishers))
