"""Reads how robots moved in a recorded run: bags of ROS 1, MCAP files and folders of bags of ROS 2."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from swarmctl.capsule.bag_files import bags_in
from swarmctl.capsule.bag_reader import DamagedBag, opened
from swarmctl.capsule.trajectory import planar
from swarmctl.swarm.topic_island import MotionTopics

#: Time, s since 1970; pose in m, m, rad; driven and commanded, each m/s and rad/s; battery, 0 to 1.
Row = tuple[float, Sequence[float] | None, Sequence[float] | None, Sequence[float] | None, float | None]

_SLOT = 200_000_000  # ns, of which a robot has one row
_HOLDS = 1_000_000_000  # ns that a speed holds without another message
_DIGITS = 3

#: The last sample in each slot, by slot: its time, ns, and its value.
_Samples = dict[int, tuple[int, Any]]
_Values = Mapping[str, Callable[[Any], Any]]  # how a topic's messages are read, by their type


@dataclass
class Run:
    """The rows of each robot that has some, in the order of time; ``troubles``: bags that are not shown."""

    rows: dict[str, list[Row]] = field(default_factory=dict)
    troubles: list[str] = field(default_factory=list)


def read(folder: Path, topics: Mapping[str, MotionTopics]) -> Run:
    """What the bags in a folder say of these robots. Raises OSError if the folder cannot be read."""
    run = Run()
    values = {topic: _VALUES[role] for one in topics.values() for role, topic in vars(one).items() if topic}
    merged: dict[str, _Samples] = {}
    for bag in bags_in(folder):
        try:
            found = _samples(bag, values)
        except DamagedBag as error:
            run.troubles.append(f"{bag} is not shown: {error}")
            continue
        for topic, samples in found.items():
            slots = merged.setdefault(topic, {})
            for slot, sample in samples.items():
                slots[slot] = max(slots.get(slot, sample), sample, key=_time)
    for name, robot in topics.items():
        of_robot = [merged.get(one, {}) for one in (robot.odometry, robot.command, robot.battery)]
        if rows := list(_rows(*of_robot)):
            run.rows[name] = rows
    return run


def _samples(bag: Path, values: Mapping[str, _Values]) -> dict[str, _Samples]:
    """The samples of a bag by topic; ``values``: how they are read. Raises ``DamagedBag``."""
    found: dict[str, _Samples] = {}
    last: dict[str, tuple[int, bytes, str]] = {}  # of each topic, read once its slot is over
    with opened(bag) as reader:

        def keep(topic: str) -> None:
            time, data, kind = last[topic]
            value = values[topic][kind](reader.deserialize(data, kind))
            found.setdefault(topic, {})[time // _SLOT] = time, value

        wanted = [one for one in reader.connections if one.msgtype in values.get(one.topic, ())]
        for connection, time, data in reader.messages(wanted) if wanted else ():
            topic = connection.topic
            if topic in last and last[topic][0] // _SLOT != time // _SLOT:
                keep(topic)
            last[topic] = time, data, connection.msgtype
        for topic in last:
            keep(topic)
    return found


def _time(sample: tuple[int, Any]) -> int:
    return sample[0]


def _odometry(message: Any) -> tuple[Sequence[float] | None, Sequence[float] | None]:
    return _numbers(*planar(message.pose.pose)), _twist(message.twist.twist)


def _twist(message: Any) -> Sequence[float] | None:
    return _numbers(message.linear.x, message.angular.z)


def _battery(message: Any) -> float | None:
    share = float(message.percentage)
    return round(share, _DIGITS) if 0.0 <= share <= 1.0 else None


def _numbers(*values: float) -> Sequence[float] | None:
    """The values, None if one is no number."""
    return [round(float(one), _DIGITS) for one in values] if all(map(math.isfinite, values)) else None


_VALUES: Mapping[str, _Values] = {
    "odometry": {"nav_msgs/msg/Odometry": _odometry},
    "command": {
        "geometry_msgs/msg/Twist": _twist,
        "geometry_msgs/msg/TwistStamped": lambda message: _twist(message.twist),
    },
    "battery": {"sensor_msgs/msg/BatteryState": _battery},
}


def _rows(odometry: _Samples, command: _Samples, battery: _Samples) -> Iterator[Row]:
    """A row for each slot with a sample, at the time of its odometry if it has some.

    It has what was recorded last, not after its time.
    """
    series = [sorted(one.values(), key=_time) for one in (odometry, command, battery)]
    ends = [0, 0, 0]
    for slot in sorted({*odometry, *command, *battery}):
        here = [one[slot][0] for one in (odometry, command, battery) if slot in one]
        time = odometry[slot][0] if slot in odometry else max(here)
        latest: list[tuple[int, Any]] = []
        for number, samples in enumerate(series):
            while ends[number] < len(samples) and samples[ends[number]][0] <= time:
                ends[number] += 1
            latest.append(samples[ends[number] - 1] if ends[number] else (time, None))
        (measured, motion), (sent, twist), (_, charge) = latest
        pose, driven = motion or (None, None)
        yield (
            -(-time // 1_000_000) / 1000,  # not before it was recorded
            pose,
            driven if time - measured <= _HOLDS else None,
            twist if time - sent <= _HOLDS else None,
            charge,
        )
