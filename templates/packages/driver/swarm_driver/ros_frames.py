"""Frames of a robot and its sensors, for tf and message headers. Their names begin with the robot's."""

from __future__ import annotations

import math
from typing import Any, Iterator, Mapping

import rospy
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3

from swarm_driver.config import Config, Sensor

TFMessage: Any
try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # a host without tf gets no transforms
    TFMessage = None


class Frames:
    """The names of the frames of one robot. No two robots on one master share a frame."""

    def __init__(self, config: Config) -> None:
        self._prefix = config.frame_prefix
        self.odom = self._prefix + "odom"
        self.base = self._prefix + "base_link"

    def joint(self, name: str) -> str:
        """Returns the name of a joint."""
        return self._prefix + name

    def element(self, sensor: Sensor, element: Mapping[str, Any]) -> str:
        """Returns the frame of one element of a sensor."""
        return "{}{}_{}".format(self._prefix, sensor.name, element["name"])


def transform(parent: str, child: str, place: tuple[float, float, float], yaw: float) -> Any:
    """Returns a TransformStamped of now; ``place`` in m, ``yaw`` in rad."""
    message = TransformStamped(child_frame_id=child)
    message.header.stamp = rospy.Time.now()
    message.header.frame_id = parent
    message.transform.translation = Vector3(*place)
    message.transform.rotation = turned_by(yaw)
    return message


def turned_by(yaw: float) -> Any:
    """Returns the Quaternion of a rotation around z, in rad."""
    return Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def publish_places(config: Config, frames: Frames) -> Any:
    """Publishes the pose of each distance sensor, latched. Returns the publisher; None if there are none."""
    ranges = [sensor for sensor in config.sensors if sensor.kind == "range" and sensor.rate > 0]
    if TFMessage is None or not ranges:
        return None
    publisher = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
    publisher.publish(TFMessage([one for sensor in ranges for one in _places(frames, sensor)]))
    return publisher


def _places(frames: Frames, sensor: Sensor) -> Iterator[Any]:
    for one in sensor.settings["elements"]:
        place = (one["x"], one["y"], one["z"])
        yield transform(frames.base, frames.element(sensor, one), place, math.radians(one["heading_deg"]))
