"""The one module that knows ROS 1: publishes commands as Twist or TwistStamped, subscribes to Joy."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from typing import Any, Callable

import rospy
from geometry_msgs.msg import Twist, TwistStamped
from sensor_msgs.msg import Joy

from swarm_onboard.teleop.config import Config
from swarm_onboard.teleop.fanout import Commands
from swarm_onboard.teleop.gamepad import Pad, noticed

_FAREWELL = 1.0  # s
_LOOK_EVERY = 1.0  # s between two looks whether the master knows the node
_MISSES = 2
_UNKNOWN_NODE = -1  # of the Master API: lookupNode found no such node


class Commander:
    """A node with one publisher a robot. It is there when the master knows it, however long that takes."""

    def __init__(self, config: Config, before_shutdown: Callable[[], None]) -> None:
        space, _, name = config.node.rpartition("/")
        os.environ["ROS_NAMESPACE"] = space or "/"
        rospy.init_node(name, disable_signals=True)
        rospy.on_shutdown(before_shutdown)  # publishing fails once ROS itself shuts down
        self._stamped = [one.stamped for one in config.targets]
        self._publishers = [
            rospy.Publisher(one.topic, TwistStamped if one.stamped else Twist, queue_size=1, tcp_nodelay=True)
            for one in config.targets
        ]

    def send(self, commands: Commands) -> None:
        """Publishes each command on its robot's topic."""
        for robot, command in commands:
            twist, stamped = Twist(), TwistStamped()
            twist.linear.x, twist.angular.z = command.linear, command.angular
            stamped.header.stamp, stamped.twist = rospy.Time.now(), twist
            with contextlib.suppress(rospy.ROSException):  # closed: ROS is shutting down
                self._publishers[robot].publish(stamped if self._stamped[robot] else twist)

    def leave(self) -> None:
        """Take leave of the master; one that is gone is not waited for."""
        farewell = threading.Thread(target=rospy.signal_shutdown, args=("the program ends",), daemon=True)
        farewell.start()
        farewell.join(_FAREWELL)


class JoyTopic:
    """The joystick's state from its messages."""

    def __init__(self, topic: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._pad: Pad | None = None
        self._clock = clock
        self.trouble = f"no message on `{topic}` yet"
        rospy.Subscriber(topic, Joy, self._take, queue_size=1, tcp_nodelay=True)

    def poll(self) -> Pad | None:
        """Returns the last state of the joystick; None before its first message."""
        return self._pad

    def _take(self, message: Any) -> None:
        self._pad = noticed(self._pad, message.axes, message.buttons, self._clock())


def when_forgotten(call: Callable[[], None]) -> threading.Event:
    """Set once the master was restarted, which rospy never notices; then calls, from a thread of its own."""
    forgotten = threading.Event()

    def watch() -> None:
        misses = 0
        while misses < _MISSES:
            time.sleep(_LOOK_EVERY)
            misses = misses + 1 if _forgotten() else 0
        forgotten.set()
        call()

    threading.Thread(target=watch, daemon=True).start()
    return forgotten


def _forgotten() -> bool:
    try:
        code, _, _ = rospy.get_master().lookupNode(rospy.get_name())
    except Exception:  # noqa: BLE001  a master that is away forgets nothing, and whatever else answers there is none
        return False
    return bool(code == _UNKNOWN_NODE)
