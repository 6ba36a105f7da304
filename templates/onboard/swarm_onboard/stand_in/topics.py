"""The stand-in as a node of ROS: takes commands, publishes what is declared."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

from swarm_onboard.command.transforms import TFMessage
from swarm_onboard.ros.node import Kind, Node, join, message_class
from swarm_onboard.ros.velocities import VELOCITIES
from swarm_onboard.stand_in import messages, truth
from swarm_onboard.stand_in.body import Body, Schedule
from swarm_onboard.stand_in.config import Config, Output, load
from swarm_onboard.stand_in.messages import untyped

_TF = "/tf"
_TRUTH = 0.1  # s between two writes of the true state
_WARNING = 2


def run(folder: Path, home: Path) -> None:
    """Runs the stand-in of this node's namespace until it is ended; ``home`` gets its true state.

    ``folder`` has the configurations.
    """
    ended = threading.Event()
    node = join("stand_in", os.environ.get("ROS_NAMESPACE", ""), ended.set)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    written = began = time.monotonic()
    topics = StandInTopics(node, load(folder, node.name.rpartition("/")[0]), began)
    while not ended.wait(topics.pause(time.monotonic())):
        now = time.monotonic()
        state = topics.step(now, now - began)
        began = now
        if now - written >= _TRUTH:
            truth.write(home, state)
            written = now
    node.leave()


class StandInTopics:
    """A body, the topics that it takes, and its publishers with their schedule.

    A topic of a type that ROS 2 lacks is left out, and logged.
    """

    def __init__(self, node: Node, config: Config, now: float) -> None:
        self._node = node
        self._config = config
        self._body = Body(config.limits)
        self._lock = threading.Lock()
        self._tf = node.publisher(_TF, TFMessage, Kind.STATE) if TFMessage else None
        found = [(one, self._class(one.topic, one.type)) for one in config.outputs if one.topic != _TF]
        self._outputs = [
            (one, kind, node.publisher(one.topic, kind, Kind.STATE if one.rate else Kind.LATCHED))
            for one, kind in found
            if kind is not None
        ]
        self._schedule = Schedule([one.rate for one, _, _ in self._outputs], now)
        for topic, kind in config.inputs:
            self._take(topic, kind, _ignored)
        if any(config.limits):
            velocity = config.command_type in VELOCITIES
            self._take(config.command, config.command_type, self._commanded if velocity else _ignored)

    def pause(self, now: float) -> float:
        """Returns the time to sleep at ``now``, s."""
        return self._schedule.pause(now)

    def step(self, now: float, seconds: float) -> Any:
        """Moves by ``seconds``, publishes what is due at ``now`` and returns the true state."""
        stamp = self._node.now()
        due = [self._outputs[index] for index in self._schedule.ready(now)]
        with self._lock:
            self._body.advance(seconds)
            ready = [(publisher, self._message(one, kind, stamp)) for one, kind, publisher in due]
            placed = messages.odometry_transform(self._config, self._body, stamp)
            state = truth.truth(self._body, self._config.wheel_separation)
        for publisher, message in ready:
            publisher.publish(message)
        if self._tf is not None and any(one.type == messages.ODOMETRY for one, _, _ in due):
            self._tf.publish(TFMessage(transforms=[placed]))
        return state

    def _message(self, output: Output, kind: Any, stamp: Any) -> Any:
        return messages.fill(kind(), output.type, self._config, self._body, stamp)

    def _class(self, topic: str, kind: str) -> Any:
        found = message_class(kind) or untyped(kind)
        if found is None:
            self._node.log(_WARNING, f"{topic} is left out: this host lacks {kind}")
        return found

    def _take(self, topic: str, kind: str, take: Any) -> None:
        found = self._class(topic, kind)
        if found is not None:
            self._node.subscribe(topic, found, take, Kind.COMMAND)

    def _commanded(self, message: Any) -> None:
        twist = getattr(message, "twist", message)
        with self._lock:
            self._body.command((twist.linear.x, twist.linear.y, twist.linear.z, twist.angular.z))


def _ignored(_message: Any) -> None:
    """What is not a velocity: the stand-in subscribes to it, as the driver does, and stays."""
