"""A node in a ring: ``ring.py NUMBER COUNT`` publishes its topic, and subscribes to that of the next.

It prints a line once both have found their other ends, and publishes nothing.
"""

from __future__ import annotations

import signal
import sys

import rclpy
from std_msgs.msg import String


def main() -> None:
    number, count = map(int, sys.argv[1:])
    ended: list[int] = []
    rclpy.init()
    signal.signal(signal.SIGTERM, lambda *_: ended.append(1))
    node = rclpy.create_node(f"node_{number}")
    following = f"topic_{(number + 1) % count}"
    publisher = node.create_publisher(String, f"topic_{number}", 1)
    node.create_subscription(String, following, print, 1)
    found = False
    while not ended:
        rclpy.spin_once(node, timeout_sec=0.1)
        if not found and publisher.get_subscription_count() and node.count_publishers(following):
            found = True
            print(number, flush=True)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
