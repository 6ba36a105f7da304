"""Frames of a robot and its sensors, for tf and message headers. Their names begin with the robot's."""

from __future__ import annotations

import math
from typing import Any, Iterator, Mapping

from geometry_msgs.msg import Quaternion

from swarm_onboard.command.transforms import Place, TFMessage, start_transform, transform, turned_by
from swarm_onboard.driver.config import Config, Sensor
from swarm_onboard.ros.node import Kind, Node

_OPTICAL = {"x": -0.5, "y": 0.5, "z": -0.5, "w": 0.5}  # from ahead-left-up to right-down-ahead


class Frames:
    """The names of the frames of one robot. No two robots on one master share a frame."""

    def __init__(self, config: Config) -> None:
        self._prefix = config.frame_prefix
        self.odom = self._prefix + "odom"
        self.base = self._prefix + "base_link"

    def element(self, sensor: Sensor, element: Mapping[str, Any]) -> str:
        """Returns the frame of one element of a sensor."""
        return "{}{}_{}".format(self._prefix, sensor.name, element["name"])

    def optical(self, sensor: Sensor) -> str:
        """Returns the frame of a camera's images: z ahead, x to the right, y down (REP 103)."""
        return f"{self._prefix}{sensor.name}_optical"


def publish_places(node: Node, config: Config, frames: Frames) -> Any:
    """Publishes what does not move, latched: the pose of each sensor, the robot's start in `map`.

    Returns the publisher; None if there is nothing.
    """
    stamp = node.now()
    start = [start_transform(config.start, frames.odom, stamp)] if config.start is not None else []
    places = [*start, *_places(config, frames, stamp)]
    if TFMessage is None or not places:
        return None
    publisher = node.publisher("/tf_static", TFMessage, Kind.LATCHED)
    publisher.publish(TFMessage(transforms=places))  # one message: a latched topic keeps the last one only
    return publisher


def _places(config: Config, frames: Frames, stamp: Any) -> Iterator[Any]:
    for sensor in config.sensors:
        for one in sensor.settings["elements"] if sensor.kind == "range" and sensor.rate > 0 else ():
            rotation = turned_by(math.radians(one["heading_deg"]))
            yield transform(frames.base, frames.element(sensor, one), _place(one), rotation, stamp)
        if sensor.kind == "image" and sensor.rate > 0:
            place, rotation = _place(sensor.settings), Quaternion(**_OPTICAL)
            yield transform(frames.base, frames.optical(sensor), place, rotation, stamp)


def _place(settings: Mapping[str, Any]) -> Place:
    return settings["x"], settings["y"], settings["z"]
