"""Bags of ROS 1, as a test wants them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from swarmctl.swarm.topic_island import MotionTopics

STORE = get_typestore(Stores.ROS1_NOETIC)
TYPES = STORE.types
BEGAN = 1_795_752_643.0  # s since 1970
LZ4 = Writer.CompressionFormat.LZ4
KOALA = {"koala": MotionTopics("/koala/odom", "/koala/cmd_vel", "/koala/battery")}

Recorded = tuple[float, str, Any]  # s after the beginning, topic, message


def odometry(
    x: float, y: float = 0.0, yaw: float = 0.0, *, speed: float = 0.0, turn: float = 0.0, robot: str = "koala"
) -> tuple[str, Any]:
    orientation = TYPES["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    pose = TYPES["geometry_msgs/msg/Pose"](point(x, y), orientation)
    unknown = numpy.zeros(36)
    return f"/{robot}/odom", TYPES["nav_msgs/msg/Odometry"](
        header(),
        "base_link",
        TYPES["geometry_msgs/msg/PoseWithCovariance"](pose, unknown),
        TYPES["geometry_msgs/msg/TwistWithCovariance"](twist(speed, turn), unknown),
    )


def command(speed: float, turn: float = 0.0, *, stamped: bool = False) -> tuple[str, Any]:
    sent = twist(speed, turn)
    if stamped:
        sent = TYPES["geometry_msgs/msg/TwistStamped"](header(), sent)
    return "/koala/cmd_vel", sent


def battery(share: float) -> tuple[str, Any]:
    none = numpy.zeros(0, numpy.float32)
    numbers = (12.0, 20.0, 0.0, 0.0, 0.0, 0.0, share)
    kind = TYPES["sensor_msgs/msg/BatteryState"]
    return "/koala/battery", kind(header(), *numbers, 0, 0, 0, True, none, none, "", "")


def header() -> Any:
    return TYPES["std_msgs/msg/Header"](0, TYPES["builtin_interfaces/msg/Time"](0, 0), "odom")


def point(x: float, y: float) -> Any:
    return TYPES["geometry_msgs/msg/Point"](x, y, 0.0)


def twist(speed: float, turn: float) -> Any:
    vector = TYPES["geometry_msgs/msg/Vector3"]
    return TYPES["geometry_msgs/msg/Twist"](vector(speed, 0.0, 0.0), vector(0.0, 0.0, turn))


def write(
    file: Path, recorded: Iterable[Recorded], compression: Writer.CompressionFormat | None = LZ4
) -> Path:
    """Writes a bag of these messages."""
    writer = Writer(file)
    if compression is not None:
        writer.set_compression(compression)
    connections: dict[str, Any] = {}
    with writer:
        for seconds, topic, message in recorded:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            time = round(1e9 * BEGAN) + round(1e9 * seconds)
            writer.write(connections[topic], time, STORE.serialize_ros1(message, kind))
    return file
