"""Messages with the time at which they were sent, s of the monotonic clock.

``stamped.py publish TYPE COUNT HZ TOPIC ...`` sends COUNT on each topic, in turns;
``stamped.py subscribe TYPE TOPIC`` prints a JSON object for each that arrives.
"""

from __future__ import annotations

import array
import json
import sys
import time
from collections.abc import Callable
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image, LaserScan

RAYS = 1080
WIDTH, HEIGHT, BYTES = 640, 480, 3
CONNECTED = 2.0  # s until a relay has found both ends
RESENT = 1.0  # s until what was lost has come again
#: The messages, and the quality of service of publisher and subscriber.
TYPES: dict[str, tuple[Callable[[], Any], Any]] = {
    "twist": (Twist, 1),
    "scan": (lambda: LaserScan(ranges=array.array("f", [1.0] * RAYS)), qos_profile_sensor_data),
    "image": (
        lambda: Image(
            width=WIDTH, height=HEIGHT, step=WIDTH * BYTES, encoding="rgb8",
            data=array.array("B", bytes(WIDTH * HEIGHT * BYTES)),
        ),
        10,
    ),
}  # fmt: skip


def stamp(message: Any) -> None:
    now = time.monotonic()
    if isinstance(message, Twist):
        message.linear.x = now
    else:
        message.header.stamp.sec, message.header.stamp.nanosec = int(now), int(now % 1 * 1e9)


def sent(message: Any) -> float:
    if isinstance(message, Twist):
        return message.linear.x
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def publish(kind: str, count: int, rate: float, topics: list[str]) -> None:
    make, quality = TYPES[kind]
    message = make()
    node = rclpy.create_node(f"{kind}_source")
    publishers = [node.create_publisher(type(message), topic, quality) for topic in topics]
    while not all(one.get_subscription_count() for one in publishers):
        time.sleep(0.1)
    time.sleep(CONNECTED)
    due = time.monotonic()
    for _ in range(count):
        for publisher in publishers:
            time.sleep(max(0.0, due - time.monotonic()))
            due += 1 / rate / len(publishers)
            stamp(message)
            publisher.publish(message)
    time.sleep(RESENT)


def subscribe(kind: str, topic: str) -> None:
    make, quality = TYPES[kind]

    def received(message: Any) -> None:
        arrived = time.monotonic()
        print(json.dumps({"sent": sent(message), "arrived": arrived}), flush=True)

    node = rclpy.create_node(f"{kind}_sink")
    node.create_subscription(type(make()), topic, received, quality)
    rclpy.spin(node)


def main() -> None:
    rclpy.init()
    match sys.argv[1:]:
        case ["publish", kind, count, rate, *topics]:
            publish(kind, int(count), float(rate), topics)
        case ["subscribe", kind, topic]:
            subscribe(kind, topic)


if __name__ == "__main__":
    main()
