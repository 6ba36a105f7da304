"""Publishes commands as Twist or TwistStamped, subscribes to Joy."""

from __future__ import annotations

import threading
import time
from typing import Any, Callable

from geometry_msgs.msg import Twist, TwistStamped
from sensor_msgs.msg import Joy

from swarm_onboard.ros.node import Kind, Node, join
from swarm_onboard.teleop.config import Config
from swarm_onboard.teleop.driving import Commands
from swarm_onboard.teleop.gamepad import Pad, noticed

_LOOK_EVERY = 1.0  # s between two looks whether the graph knows the node
_MISSES = 2


class Commander:
    """A node with one publisher a robot. It is there when the graph knows it, however long that takes."""

    def __init__(self, config: Config, before_shutdown: Callable[[], None]) -> None:
        namespace, _, name = config.node.rpartition("/")
        self.node = join(name, namespace, before_shutdown)  # publishing fails once ROS itself shuts down
        self._stamped = [one.stamped for one in config.targets]
        self._publishers = [
            self.node.publisher(one.topic, TwistStamped if one.stamped else Twist, Kind.COMMAND)
            for one in config.targets
        ]

    def send(self, commands: Commands) -> None:
        """Publishes each command on its robot's topic."""
        for robot, command in commands:
            twist, stamped = Twist(), TwistStamped()
            twist.linear.x, twist.angular.z = command.linear, command.angular
            stamped.header.stamp, stamped.twist = self.node.now(), twist
            self._publishers[robot].publish(stamped if self._stamped[robot] else twist)

    def leave(self) -> None:
        """Leaves the graph."""
        self.node.leave()


class JoyTopic:
    """The joystick's state from its messages."""

    def __init__(self, node: Node, topic: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._pad: Pad | None = None
        self._clock = clock
        self.trouble = f"no message on `{topic}` yet"
        node.subscribe(topic, Joy, self._take, Kind.SENSOR)

    def poll(self) -> Pad | None:
        """Returns the last state of the joystick; None before its first message."""
        return self._pad

    def _take(self, message: Any) -> None:
        self._pad = noticed(self._pad, message.axes, message.buttons, self._clock())


def when_forgotten(node: Node, call: Callable[[], None]) -> threading.Event:
    """Set once a master was restarted, which rospy never notices; then calls, from a thread of its own."""
    forgotten = threading.Event()

    def watch() -> None:
        misses = 0
        while misses < _MISSES:
            time.sleep(_LOOK_EVERY)
            misses = misses + 1 if node.is_forgotten() else 0
        forgotten.set()
        call()

    threading.Thread(target=watch, daemon=True).start()
    return forgotten
