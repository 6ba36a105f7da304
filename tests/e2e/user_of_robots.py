"""One node that uses all topics of robots: ``user_of_robots.py ROBOTS``, JSON: by name, the topics with their
types, the command (m/s, rad/s) and the settings by topic.

It prints a line when every topic has brought a message, or its input a line. It then commands and sets
until a line comes, and prints the moment of its last command; after another line, and once odometry is newer
than that, what came of each robot: by topic, the frame and its child; the first pose and the last; the name
of the diagnostics.
"""

from __future__ import annotations

import json
import math
import os
import select
import sys
import threading
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import UInt8, UInt8MultiArray

RATE = 10.0  # Hz
ROBOTS: dict[str, Any] = json.loads(sys.argv[1])
SEEN: dict[str, Any] = {name: {"frames": {}, "poses": [], "statuses": []} for name in ROBOTS}
STAMPS = dict.fromkeys(ROBOTS, 0.0)  # of the last odometry, s since the epoch


class Ros1:
    """A node of rospy."""

    def __init__(self) -> None:
        import rospy

        self._rospy = rospy
        rospy.init_node("drive")

    def publisher(self, topic: str, kind: Any) -> Any:
        return self._rospy.Publisher(topic, kind, queue_size=1)

    def subscribe(self, topic: str, kind: Any, take: Callable[[Any], None]) -> Callable[[], None]:
        """Returns what ends it."""
        ended: Callable[[], None] = self._rospy.Subscriber(topic, kind, take).unregister
        return ended


class Ros2:
    """A node of rclpy."""

    def __init__(self) -> None:
        import rclpy
        from rclpy.qos import qos_profile_sensor_data

        rclpy.init()
        self._node, self._quality = rclpy.create_node("drive"), qos_profile_sensor_data
        self._rclpy = rclpy
        self._ended: list[Any] = []

    def publisher(self, topic: str, kind: Any) -> Any:
        return self._node.create_publisher(kind, topic, 1)

    def subscribe(self, topic: str, kind: Any, take: Callable[[Any], None]) -> Callable[[], None]:
        """Returns what ends it."""
        subscription = self._node.create_subscription(kind, topic, take, self._quality)
        return lambda: self._ended.append(subscription)

    def spin(self) -> None:
        """Takes messages, for ever; ends subscriptions in between."""
        while True:
            self._rclpy.spin_once(self._node)
            while self._ended:
                self._node.destroy_subscription(self._ended.pop())


def main() -> None:
    node: Any = Ros2() if os.environ.get("ROS_VERSION") == "2" else Ros1()
    publishers = [(topic_of(robot, "cmd_vel"), twist(*one["command"])) for robot, one in ROBOTS.items()]
    commands = [(node.publisher(topic, Twist), message) for topic, message in publishers]
    settings = [
        (node.publisher(topic_of(robot, topic), type(message)), message)
        for robot, one in ROBOTS.items()
        for topic, values in one["settings"].items()
        for message in [setting(values)]
    ]
    for robot, one in ROBOTS.items():
        node.subscribe(topic_of(robot, "odom"), Odometry, lambda message, robot=robot: moved(robot, message))
        for topic, kind in one["topics"].items():
            first_of(node, robot, topic, kind)
    node.subscribe("/diagnostics", DiagnosticArray, diagnosed)
    if isinstance(node, Ros2):
        threading.Thread(target=node.spin, daemon=True).start()
    wait(lambda: all_came() or a_line())
    print(flush=True)
    last = time.monotonic()
    while not a_line():
        last = time.monotonic()
        send(commands, settings)
        time.sleep(1 / RATE)
    print(last, flush=True)
    wait(a_line)
    stands = time.time()
    wait(lambda: min(STAMPS.values()) > stands)
    print(json.dumps(SEEN), flush=True)


def wait(until: Callable[[], bool]) -> None:
    while not until():
        time.sleep(1 / RATE)


def send(*groups: list[tuple[Any, Any]]) -> None:
    for group in groups:
        for publisher, message in group:
            publisher.publish(message)


def a_line() -> bool:
    return bool(select.select([sys.stdin], [], [], 0)[0]) and bool(sys.stdin.readline())


def topic_of(robot: str, topic: str) -> str:
    return topic if topic.startswith("/") else f"/{robot}/{topic}"


def twist(linear: float, angular: float) -> Twist:
    message = Twist()
    message.linear.x, message.angular.z = linear, angular
    return message


def setting(values: list[int]) -> Any:
    return UInt8(data=values[0]) if len(values) == 1 else UInt8MultiArray(data=values)


def first_of(node: Any, robot: str, topic: str, kind: str) -> None:
    """Notes the frames of the first message of a topic."""
    package, name = kind.split("/")
    ends: list[Callable[[], None]] = []

    def take(message: Any) -> None:
        frame = message.header.frame_id if hasattr(message, "header") else ""
        SEEN[robot]["frames"][topic] = [frame, getattr(message, "child_frame_id", "")]
        while ends:
            ends.pop()()

    ends.append(node.subscribe(topic_of(robot, topic), getattr(import_module(f"{package}.msg"), name), take))


def all_came() -> bool:
    return all(
        seen["poses"] and seen["statuses"] and seen["frames"].keys() == ROBOTS[robot]["topics"].keys()
        for robot, seen in SEEN.items()
    )


def moved(robot: str, message: Any) -> None:
    pose = message.pose.pose
    turn = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
    SEEN[robot]["poses"][1:] = [[pose.position.x, pose.position.y, turn]]
    stamp = message.header.stamp
    STAMPS[robot] = stamp.to_sec() if hasattr(stamp, "to_sec") else stamp.sec + stamp.nanosec * 1e-9


def diagnosed(message: Any) -> None:
    for status in message.status:
        robot = status.name.split(":")[0]
        if robot in SEEN:
            SEEN[robot]["statuses"] = [status.name]


if __name__ == "__main__":
    main()
