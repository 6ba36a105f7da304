"""A node of rospy: ``ros1_node.py NAME PUBLISHES SUBSCRIBES``; reads and prints JSON, a value a line.

PUBLISHES: {topic: [type, latched]}; SUBSCRIBES: {topic: [type, path of the field to print]}.
"""

import json
import os
import sys
from operator import attrgetter

import rospy
from roslib.message import get_message_class

name, publishes, subscribes = sys.argv[1], *map(json.loads, sys.argv[2:])
rospy.names._set_caller_id(name)
rospy.init_node(name.rpartition("/")[2], disable_signals=True)
publishers = {
    topic: rospy.Publisher(topic, get_message_class(kind), latch=latched, queue_size=10)
    for topic, (kind, latched) in publishes.items()
}


def show(topic, path):
    def received(message):
        sender = message._connection_header["callerid"]
        line = json.dumps({"topic": topic, "from": sender, "value": attrgetter(path)(message)})
        os.write(1, f"{line}\n".encode())  # in one piece: each connection has a thread of its own

    return received


for topic, (kind, path) in subscribes.items():
    rospy.Subscriber(topic, get_message_class(kind), show(topic, path))
for line in sys.stdin:
    topic, path, value = json.loads(line)
    message = publishers[topic].data_class()
    outer, _, field = path.rpartition(".")
    setattr(attrgetter(outer)(message) if outer else message, field, value)
    publishers[topic].publish(message)
rospy.signal_shutdown("its input has ended")
