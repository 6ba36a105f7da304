"""A node of rclpy, as that of rospy beside this file; ``[topic]`` on its input prints who publishes it."""

import contextlib
import json
import sys
import threading
from importlib import import_module
from operator import attrgetter

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile

name, publishes, subscribes = sys.argv[1], *map(json.loads, sys.argv[2:])
space, _, own = name.rpartition("/")
rclpy.init()
node = rclpy.create_node(own, namespace=space)
lock = threading.Lock()


def class_of(kind):
    package, _, name = kind.partition("/")
    return getattr(import_module(f"{package}.msg"), name)


def profile(latched):
    return QoSProfile(
        depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    )


def show(value):
    with lock:
        print(json.dumps(value), flush=True)


def reporter(topic, path):
    def received(message):
        value = attrgetter(path)(message)
        if topic == "/diagnostics":
            value = [[ord(one.level), one.message, {v.key: v.value for v in one.values}] for one in value]
        show({"topic": topic, "value": value})

    return received


publishers = {
    topic: node.create_publisher(class_of(kind), topic, profile(latched))
    for topic, (kind, latched) in publishes.items()
}
for topic, (kind, path, latched) in subscribes.items():
    node.create_subscription(class_of(kind), topic, reporter(topic, path), profile(latched))


def spin():
    with contextlib.suppress(ExternalShutdownException):
        rclpy.spin(node)


spinning = threading.Thread(target=spin)
spinning.start()
for line in sys.stdin:
    topic, *rest = json.loads(line)
    if not rest:
        found = node.get_publishers_info_by_topic(topic)
        show(
            {
                "publishers": topic,
                "nodes": sorted(f"{o.node_namespace.rstrip('/')}/{o.node_name}" for o in found),
            }
        )
        continue
    path, value = rest
    if not path:  # as it would be serialised
        publishers[topic].publish(value.encode())
        continue
    message = publishers[topic].msg_type()
    outer, _, field = path.rpartition(".")
    setattr(attrgetter(outer)(message) if outer else message, field, value)
    publishers[topic].publish(message)
rclpy.shutdown()
spinning.join()
node.destroy_node()  # otherwise others see it for 20 s
