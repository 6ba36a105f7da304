"""The topics of the bags of a trial: their number of messages, and their poses, at full rate."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

from swarmctl.capsule.bag_files import bags_in, recorder
from swarmctl.capsule.bag_reader import DamagedBag, opened
from swarmctl.capsule.capsule_index import LONGEST
from swarmctl.capsule.trajectory import RecordedTopic, Sample, planar
from swarmctl.remote.answer_check import printable
from swarmctl.swarm.topic_island import full_name

_FARTHEST = 1e9  # m: no robot is there
_ODOMETRY = "nav_msgs/msg/Odometry"

#: How a message of each type with a pose is read: x, y, yaw, as ``planar`` has them.
_POSES: dict[str, Callable[[Any], tuple[float, float, float]]] = {
    _ODOMETRY: lambda message: planar(message.pose.pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda message: planar(message.pose.pose),
    "geometry_msgs/msg/PoseStamped": lambda message: planar(message.pose),
    "geometry_msgs/msg/Pose": planar,
    "geometry_msgs/msg/Pose2D": lambda message: (message.x, message.y, message.theta),
}


@dataclass
class RecordedTopics:
    """Topics by their full names, which are printable; ``troubles``: bags that are not read, and why."""

    topics: dict[str, RecordedTopic] = field(default_factory=dict)
    troubles: list[str] = field(default_factory=list)


def read(
    folder: Path, wanted: Collection[str] | None = None, since: Callable[[str], float] = lambda _: 0.0
) -> RecordedTopics:
    """Returns the topics of these full names, or else all with a pose, of the bags in a folder.

    ``since`` gives s since 1970 for a host: what its bags have before does not count. Of a topic that several
    hosts recorded, the bags of the one with the most messages count. A folder that does not exist has none.
    """
    found = RecordedTopics()
    try:
        bags = bags_in(folder)
    except FileNotFoundError:
        return found
    except OSError as error:
        found.troubles.append(f"{_shown(folder)} is not read: {error.strerror}")
        return found
    recorded: dict[str, dict[str, RecordedTopic]] = {}
    for bag in bags:
        host = recorder(bag)
        try:
            topics = _topics(bag, wanted, since(host))
        except DamagedBag as error:
            found.troubles.append(f"{_shown(bag)} is not read: {error}")
            continue
        of_host = recorded.setdefault(host, {})
        for name, topic in topics.items():
            before = of_host.setdefault(name, RecordedTopic(odometry=topic.odometry, recorder=host))
            before.messages += topic.messages
            before.samples += topic.samples
    for of_host in recorded.values():
        for name, topic in of_host.items():
            if name not in found.topics or topic.messages > found.topics[name].messages:
                found.topics[name] = topic
    for topic in found.topics.values():
        topic.samples.sort(key=lambda one: one.t)
    return found


def _topics(bag: Path, wanted: Collection[str] | None, since: float) -> dict[str, RecordedTopic]:
    """Raises ``DamagedBag``."""
    found: dict[str, RecordedTopic] = {}
    with opened(bag) as reader:
        chosen = [
            one
            for one in reader.connections
            if (_name(one.topic) in wanted if wanted is not None else one.msgtype in _POSES)
        ]
        for one in chosen:
            found.setdefault(_name(one.topic), RecordedTopic(odometry=one.msgtype == _ODOMETRY))
        for connection, time, data in reader.messages(chosen) if chosen else ():
            if time / 1e9 < since:
                continue
            topic = found[_name(connection.topic)]
            topic.messages += 1
            if connection.msgtype not in _POSES:
                continue
            message = reader.deserialize(data, connection.msgtype)
            x, y, yaw = map(float, _POSES[connection.msgtype](message))
            if abs(x) < _FARTHEST and abs(y) < _FARTHEST and isfinite(yaw):
                speed = _speed(message) if connection.msgtype == _ODOMETRY else None
                topic.samples.append(Sample(time / 1e9, x, y, yaw, speed))
    return found


def _speed(message: Any) -> float | None:
    speed = float(message.twist.twist.linear.x)
    return speed if isfinite(speed) else None


def _name(topic: str) -> str:
    return printable(full_name(topic).encode(errors="backslashreplace"))[:LONGEST]


def _shown(path: Path) -> str:
    return printable(os.fsencode(path))
