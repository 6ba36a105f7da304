"""Sensor readings as messages of ROS 1: one class for each kind of sensor, each with its topics."""

from __future__ import annotations

import math
from typing import Any, Callable, Mapping, Protocol, Sequence

import rospy
from std_msgs.msg import Float32MultiArray, MultiArrayDimension, UInt16MultiArray

from swarm_driver import readings
from swarm_driver.codec import Values
from swarm_driver.config import Config, Sensor
from swarm_driver.ros_frames import Frames

sensor_msgs: Any
try:
    from sensor_msgs import msg as sensor_msgs
except ImportError:  # a host without it gets lists of numbers only
    sensor_msgs = None

_INFRARED, _ULTRASOUND = 1, 0  # of sensor_msgs/Range: INFRARED, ULTRASOUND
_NOT_MEASURED = [-1.0] + [0.0] * 8  # a covariance that says so (sensor_msgs/Imu)


class SensorTopics(Protocol):
    """The topics of one sensor."""

    def publish(self, values: Values) -> None:
        """Publishes one reading; ``values`` are the raw numbers."""


class RawTopic:
    """Whole numbers as the robot gives them, labelled with their names."""

    def __init__(self, sensor: Sensor, frames: Frames) -> None:
        self._names = sensor.settings["names"]
        self._publisher = rospy.Publisher(sensor.name, UInt16MultiArray, queue_size=1)

    def publish(self, values: Values) -> None:
        self._publisher.publish(_labelled(UInt16MultiArray(data=readings.whole(values)), self._names))


class QuantityTopic:
    """Numbers with a unit, labelled with their names."""

    def __init__(self, sensor: Sensor, frames: Frames) -> None:
        self._settings = sensor.settings
        self._publisher = rospy.Publisher(sensor.name, Float32MultiArray, queue_size=1)

    def publish(self, values: Values) -> None:
        data = readings.scaled(values, self._settings)
        self._publisher.publish(_labelled(Float32MultiArray(data=data), self._settings["names"]))


class RangeTopics:
    """The raw readings of an array as one message; each element in metres if its topic has a subscriber."""

    def __init__(self, sensor: Sensor, frames: Frames) -> None:
        settings = sensor.settings
        self._stride, self._largest = settings["stride"], settings["max_reading"]
        self._names = [one["name"] for one in settings["elements"]]
        self._distances = readings.Distances(settings)
        self._field_of_view = math.radians(settings["field_of_view_deg"])
        self._radiation = _ULTRASOUND if settings["radiation"] == "ultrasound" else _INFRARED
        self._frames = [frames.element(sensor, one) for one in settings["elements"]]
        self._publisher = rospy.Publisher(sensor.name, UInt16MultiArray, queue_size=1)
        self._elements = [
            rospy.Publisher(f"{sensor.name}/{name}", sensor_msgs.Range, queue_size=1)
            for name in (self._names if sensor_msgs else ())
        ]

    def publish(self, values: Values) -> None:
        raw = readings.whole(readings.every(values, self._stride), self._largest)
        self._publisher.publish(_labelled(UInt16MultiArray(data=raw), self._names))
        for publisher, frame, reading in zip(self._elements, self._frames, raw):
            if publisher.get_num_connections() > 0:
                publisher.publish(self._range(frame, reading))

    def _range(self, frame: str, reading: int) -> Any:
        message = sensor_msgs.Range(
            radiation_type=self._radiation,
            field_of_view=self._field_of_view,
            min_range=self._distances.nearest,
            max_range=self._distances.farthest,
            range=self._distances.metres(reading),
        )
        return _stamped(message, frame)


class ImuTopic:
    """Acceleration, rotation or both; each message marks what it lacks, such as the orientation."""

    def __init__(self, sensor: Sensor, frames: Frames) -> None:
        self._settings, self._frame = sensor.settings, frames.base
        self._publisher = rospy.Publisher(sensor.name, sensor_msgs.Imu, queue_size=1)

    def publish(self, values: Values) -> None:
        measured = readings.motion(values, self._settings)
        message = _stamped(sensor_msgs.Imu(orientation_covariance=_NOT_MEASURED), self._frame)
        if measured.acceleration is None:
            message.linear_acceleration_covariance = _NOT_MEASURED
        else:
            _put(message.linear_acceleration, measured.acceleration)
        if measured.rotation is None:
            message.angular_velocity_covariance = _NOT_MEASURED
        else:
            _put(message.angular_velocity, measured.rotation)
        self._publisher.publish(message)


class MagneticTopic:
    """The magnetic field, in T."""

    def __init__(self, sensor: Sensor, frames: Frames) -> None:
        self._axes, self._frame = sensor.settings["axes"], frames.base
        self._publisher = rospy.Publisher(sensor.name, sensor_msgs.MagneticField, queue_size=1)

    def publish(self, values: Values) -> None:
        message = _stamped(sensor_msgs.MagneticField(), self._frame)
        _put(message.magnetic_field, readings.vector(values, self._axes))
        self._publisher.publish(message)


class BatteryTopic:
    """Voltage and charge; NaN for what is not measured, as in sensor_msgs/BatteryState."""

    def __init__(self, sensor: Sensor, frames: Frames) -> None:
        self._settings, self._frame = sensor.settings, frames.base
        self._publisher = rospy.Publisher(sensor.name, sensor_msgs.BatteryState, queue_size=1)

    def publish(self, values: Values) -> None:
        charge = readings.charge(values, self._settings)
        unknown = dict.fromkeys(("temperature", "current", "charge", "capacity", "design_capacity"), math.nan)
        message = sensor_msgs.BatteryState(
            voltage=charge.volts, percentage=charge.share, present=True, **unknown
        )
        self._publisher.publish(_stamped(message, self._frame))


class TemperatureTopic:
    """A temperature, in degrees Celsius."""

    def __init__(self, sensor: Sensor, frames: Frames) -> None:
        self._settings, self._frame = sensor.settings, frames.base
        self._publisher = rospy.Publisher(sensor.name, sensor_msgs.Temperature, queue_size=1)

    def publish(self, values: Values) -> None:
        (celsius,) = readings.scaled(values, self._settings)
        self._publisher.publish(_stamped(sensor_msgs.Temperature(temperature=celsius), self._frame))


class ImageTopic:
    """Images of a camera, grey or in colours."""

    def __init__(self, sensor: Sensor, frames: Frames) -> None:
        self._settings, self._frame = sensor.settings, frames.base
        self._publisher = rospy.Publisher(sensor.name, sensor_msgs.Image, queue_size=1)

    def publish(self, values: Values) -> None:
        encoding, pixels = readings.picture(values, self._settings)
        height = self._settings["height"]
        message = sensor_msgs.Image(
            height=height,
            width=self._settings["width"],
            encoding=encoding,
            step=len(pixels) // height,
            data=pixels,
        )
        self._publisher.publish(_stamped(message, self._frame))


_KINDS: Mapping[str, Callable[[Sensor, Frames], SensorTopics]] = {
    "range": RangeTopics,
    "raw": RawTopic,
    "quantity": QuantityTopic,
    "imu": ImuTopic,
    "magnetic": MagneticTopic,
    "battery": BatteryTopic,
    "temperature": TemperatureTopic,
    "image": ImageTopic,
}
_WITHOUT_SENSOR_MSGS = ("raw", "quantity", "range")


def topics_of(config: Config, frames: Frames) -> dict[str, SensorTopics]:
    """Returns the topics of every enabled sensor for which this host has messages, by its name."""
    return {
        one.name: _KINDS[one.kind](one, frames)
        for one in config.sensors
        if one.rate > 0 and one.kind in _KINDS and (sensor_msgs or one.kind in _WITHOUT_SENSOR_MSGS)
    }


def _labelled(message: Any, names: Sequence[str]) -> Any:
    message.layout.dim = [
        MultiArrayDimension(label=",".join(names), size=len(message.data), stride=len(message.data))
    ]
    return message


def _stamped(message: Any, frame: str) -> Any:
    message.header.stamp = rospy.Time.now()
    message.header.frame_id = frame
    return message


def _put(target: Any, vector: readings.Vector) -> None:
    target.x, target.y, target.z = vector
