"""The stand-in as a node of ROS 1. Nothing outside this file knows ROS."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

import roslib.message
import rospy
from geometry_msgs.msg import TransformStamped, Twist, TwistStamped
from tf2_msgs.msg import TFMessage

from swarm_onboard.stand_in import messages, truth
from swarm_onboard.stand_in.body import Body
from swarm_onboard.stand_in.config import Config, Output, load
from swarm_onboard.stand_in.schedule import Schedule

_VELOCITIES = {"geometry_msgs/Twist": Twist, "geometry_msgs/TwistStamped": TwistStamped}
_TRUTH = 0.1  # s between two writes of the true state


def run(folder: Path, home: Path) -> None:
    """Runs the stand-in of this node's namespace until ROS shuts it down; ``home`` gets its true state."""
    rospy.init_node("stand_in")
    written = began = time.monotonic()
    node = _Node(load(folder, rospy.get_namespace()), began)
    while not rospy.is_shutdown():
        now = time.monotonic()
        state = node.step(now, now - began)
        began = now
        if now - written >= _TRUTH:
            truth.write(home, state)
            written = now
        time.sleep(node.pause(time.monotonic()))


class _Node:
    """A body, the topics that it takes, and its publishers with their schedule."""

    def __init__(self, config: Config, now: float) -> None:
        self._config = config
        self._body = Body(config.limits)
        self._lock = threading.Lock()
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=5)
        outputs = [one for one in config.outputs if one.topic != "/tf"]
        self._outputs = [(one, kind, _publisher(one, kind)) for one in outputs for kind in [_class(one.type)]]
        self._schedule = Schedule([one.rate for one in outputs], now)
        for topic in config.inputs:
            rospy.Subscriber(topic, rospy.AnyMsg, _ignored, queue_size=1)
        if any(config.limits):
            velocity = _VELOCITIES.get(config.command_type)
            taken = self._commanded if velocity is not None else _ignored
            kind = velocity or rospy.AnyMsg
            rospy.Subscriber(config.command, kind, taken, queue_size=1, tcp_nodelay=True)

    def pause(self, now: float) -> float:
        """Returns the time to sleep at ``now``, s."""
        return self._schedule.pause(now)

    def step(self, now: float, seconds: float) -> Any:
        """Moves by ``seconds``, publishes what is due at ``now`` and returns the true state."""
        stamp = rospy.Time.now()
        due = [self._outputs[index] for index in self._schedule.ready(now)]
        with self._lock:
            self._body.advance(seconds)
            ready = [(one, self._message(one[0], one[1], stamp)) for one in due]
            state = truth.truth(self._body, self._config.wheel_separation)
        for (_, _, publisher), made in ready:
            for message in made:
                (self._tf if isinstance(message, TFMessage) else publisher).publish(message)
        return state

    def _message(self, output: Output, kind: Any, stamp: Any) -> list[Any]:
        message = messages.fill(kind(), output.type, self._config, self._body, stamp)
        if output.type != messages.ODOMETRY:
            return [message]
        placed = messages.transform(TransformStamped(), self._config, self._body, stamp)
        return [message, TFMessage([placed])]

    def _commanded(self, message: Any) -> None:
        twist = getattr(message, "twist", message)
        with self._lock:
            self._body.command((twist.linear.x, twist.linear.y, twist.linear.z, twist.angular.z))


def _ignored(_message: Any) -> None:
    """What is not a velocity: the stand-in subscribes to it, as the driver does, and stays."""


def _publisher(output: Output, kind: Any) -> Any:
    return rospy.Publisher(output.topic, kind, queue_size=5, latch=output.rate == 0)


def _class(kind: str) -> Any:
    """Returns the message class of a type; for one that is not installed, a class without content.

    Its MD5 sum is the wildcard of rospy, so nodes that only count or look up the topic see it; no node with
    the real type connects.
    """
    known = roslib.message.get_message_class(kind)
    if known is not None:
        return known
    empty = {"_type": kind, "_md5sum": rospy.AnyMsg._md5sum, "__init__": _without_content}
    return type(kind.rpartition("/")[2], (rospy.AnyMsg,), empty)


def _without_content(message: Any) -> None:
    rospy.AnyMsg.__init__(message)
    message._buff = b""
