"""What a person types on a host to publish a command, or to read the diagnostics of a driver."""

from __future__ import annotations

from typing import Protocol

_PUBLISH = """\
import sys, time, rclpy
from geometry_msgs.msg import Twist
topic, linear, angular, rate = sys.argv[1], *map(float, sys.argv[2:5])
rclpy.init()
node = rclpy.create_node("ros2_topic_pub")
publisher = node.create_publisher(Twist, topic, 1)
twist = Twist()
twist.linear.x, twist.angular.z = linear, angular
while True:
    publisher.publish(twist)
    time.sleep(1 / rate)
"""
_DIAGNOSIS = """\
import sys, rclpy
from diagnostic_msgs.msg import DiagnosticArray
rclpy.init()
node = rclpy.create_node("ros2_topic_echo")
found = []
def take(message):
    found.extend(str(one) for one in message.status if one.name == sys.argv[1])
node.create_subscription(DiagnosticArray, "/diagnostics", take, 10)
while not found:
    rclpy.spin_once(node)
print(found[0])
"""


class RosCommands(Protocol):
    """Commands for a shell in which the environment of the swarm is set."""

    name: str
    stranger: str

    def publish(self, topic: str, linear: float, angular: float, rate: float) -> str:
        """Returns the command that publishes geometry_msgs/Twist as the node ``stranger``, for ever."""

    def diagnosis(self, name: str) -> str:
        """Returns the command that prints the next diagnostics of that name."""


class Ros1:
    """With the tools of ROS 1."""

    name = "ROS 1"
    stranger = "/rostopic"

    def publish(self, topic: str, linear: float, angular: float, rate: float) -> str:
        twist = f"{{linear: {{x: {linear}}}, angular: {{z: {angular}}}}}"
        return f"rostopic pub -r {rate} {topic} geometry_msgs/Twist '{twist}'"

    def diagnosis(self, name: str) -> str:
        wanted = f"m.status[0].name == '{name}'"
        return f'timeout 10 rostopic echo -n 1 --filter "{wanted}" /diagnostics'


class Ros2:
    """With rclpy: the lab has no `ros2` command."""

    name = "ROS 2"
    stranger = "/ros2_topic_pub"

    def publish(self, topic: str, linear: float, angular: float, rate: float) -> str:
        return f"python3 -c '{_PUBLISH}' {topic} {linear} {angular} {rate}"

    def diagnosis(self, name: str) -> str:
        return f"timeout 10 python3 -c '{_DIAGNOSIS}' '{name}'"
