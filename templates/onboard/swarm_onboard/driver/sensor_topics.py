"""Sensor readings as messages of ROS: one class for each kind of sensor, each with its topics."""

from __future__ import annotations

import math
from typing import Any, Callable, Mapping, Protocol, Sequence

from std_msgs.msg import Float32MultiArray, MultiArrayDimension, UInt16MultiArray

from swarm_onboard.driver import readings, scan
from swarm_onboard.driver.codec import Values
from swarm_onboard.driver.config import Config, Sensor
from swarm_onboard.driver.frames import Frames
from swarm_onboard.ros.node import Kind, Node

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

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        self._names = sensor.settings["names"]
        self._publisher = node.publisher(sensor.name, UInt16MultiArray, Kind.SENSOR)

    def publish(self, values: Values) -> None:
        self._publisher.publish(_labelled(UInt16MultiArray(data=readings.whole(values)), self._names))


class QuantityTopic:
    """Numbers with a unit, labelled with their names."""

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        self._settings = sensor.settings
        self._publisher = node.publisher(sensor.name, Float32MultiArray, Kind.SENSOR)

    def publish(self, values: Values) -> None:
        data = readings.scaled(values, self._settings)
        self._publisher.publish(_labelled(Float32MultiArray(data=data), self._settings["names"]))


class RangeTopics:
    """The raw readings of an array as one message; in metres, with a subscriber, each alone and as a scan."""

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        settings, self._node = sensor.settings, node
        self._stride, self._largest = settings["stride"], settings["max_reading"]
        self._names = [one["name"] for one in settings["elements"]]
        self._distances = readings.Distances(settings)
        self._field_of_view = math.radians(settings["field_of_view_deg"])
        self._radiation = _ULTRASOUND if settings["radiation"] == "ultrasound" else _INFRARED
        self._frames = [frames.element(sensor, one) for one in settings["elements"]]
        self._publisher = node.publisher(sensor.name, UInt16MultiArray, Kind.SENSOR)
        self._elements = [
            node.publisher(f"{sensor.name}/{name}", sensor_msgs.Range, Kind.SENSOR)
            for name in (self._names if sensor_msgs else ())
        ]
        self.scan: ScanTopic | None = None
        if sensor_msgs and len(self._names) > 1:
            self.scan = ScanTopic(node, sensor, frames)

    def publish(self, values: Values) -> None:
        raw = readings.whole(readings.every(values, self._stride), self._largest)
        self._publisher.publish(_labelled(UInt16MultiArray(data=raw), self._names))
        stamp = self._node.now()
        for publisher, frame, reading in zip(self._elements, self._frames, raw):
            if publisher.listeners() > 0:
                publisher.publish(self._range(frame, reading, stamp))
        if self.scan is not None and self.scan.wanted():
            self.scan.publish([self._distances.metres(reading) for reading in raw], stamp)

    def _range(self, frame: str, reading: int, stamp: Any) -> Any:
        message = sensor_msgs.Range(
            radiation_type=self._radiation,
            field_of_view=self._field_of_view,
            min_range=self._distances.nearest,
            max_range=self._distances.farthest,
            range=self._distances.metres(reading),
        )
        return _stamped(message, frame, stamp)


class ScanTopic:
    """The distances of an array around the robot, as a laser scanner would have them."""

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        self.period = 1 / sensor.rate
        self._scan, self._frame = scan.Scan(sensor.settings), frames.base
        self._publisher = node.publisher(f"{sensor.name}/scan", sensor_msgs.LaserScan, Kind.SENSOR)

    def wanted(self) -> bool:
        """Returns whether somebody subscribes."""
        return self._publisher.listeners() > 0

    def publish(self, distances: Sequence[float], stamp: Any) -> None:
        """Publishes one scan; ``distances`` in m, in the order of the sensors."""
        message = sensor_msgs.LaserScan(
            angle_min=scan.FIRST,
            angle_max=scan.FIRST + (scan.RAYS - 1) * scan.STEP,
            angle_increment=scan.STEP,
            scan_time=self.period,
            range_min=self._scan.nearest,
            range_max=self._scan.farthest,
            ranges=self._scan.ranges(distances),
        )
        self._publisher.publish(_stamped(message, self._frame, stamp))


class ImuTopic:
    """Acceleration, rotation or both; each message marks what it lacks, such as the orientation."""

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        self._node = node
        self._settings, self._frame = sensor.settings, frames.base
        self._publisher = node.publisher(sensor.name, sensor_msgs.Imu, Kind.SENSOR)

    def publish(self, values: Values) -> None:
        measured = readings.motion(values, self._settings)
        message = sensor_msgs.Imu(orientation_covariance=_NOT_MEASURED)
        _stamped(message, self._frame, self._node.now())
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

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        self._node = node
        self._axes, self._frame = sensor.settings["axes"], frames.base
        self._publisher = node.publisher(sensor.name, sensor_msgs.MagneticField, Kind.SENSOR)

    def publish(self, values: Values) -> None:
        message = _stamped(sensor_msgs.MagneticField(), self._frame, self._node.now())
        _put(message.magnetic_field, readings.vector(values, self._axes))
        self._publisher.publish(message)


class BatteryTopic:
    """Voltage and charge; NaN for what is not measured, as in sensor_msgs/BatteryState."""

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        self._node = node
        self._settings, self._frame = sensor.settings, frames.base
        self._publisher = node.publisher(sensor.name, sensor_msgs.BatteryState, Kind.SENSOR)

    def publish(self, values: Values) -> None:
        charge = readings.charge(values, self._settings)
        unknown = dict.fromkeys(("temperature", "current", "charge", "capacity", "design_capacity"), math.nan)
        message = sensor_msgs.BatteryState(
            voltage=charge.volts, percentage=charge.share, present=True, **unknown
        )
        self._publisher.publish(_stamped(message, self._frame, self._node.now()))


class TemperatureTopic:
    """A temperature, in degrees Celsius."""

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        self._node = node
        self._settings, self._frame = sensor.settings, frames.base
        self._publisher = node.publisher(sensor.name, sensor_msgs.Temperature, Kind.SENSOR)

    def publish(self, values: Values) -> None:
        (celsius,) = readings.scaled(values, self._settings)
        message = sensor_msgs.Temperature(temperature=celsius)
        self._publisher.publish(_stamped(message, self._frame, self._node.now()))


class ImageTopics:
    """Images of a camera, grey or in colours, and what is known of its lens."""

    def __init__(self, node: Node, sensor: Sensor, frames: Frames) -> None:
        self._node = node
        self._settings, self._frame = sensor.settings, frames.optical(sensor)
        self._images = node.publisher(f"{sensor.name}/image_raw", sensor_msgs.Image, Kind.SENSOR)
        self._infos = node.publisher(f"{sensor.name}/camera_info", sensor_msgs.CameraInfo, Kind.SENSOR)

    def publish(self, values: Values) -> None:
        encoding, pixels = readings.picture(values, self._settings)
        height, width = self._settings["height"], self._settings["width"]
        message = sensor_msgs.Image(
            height=height,
            width=width,
            encoding=encoding,
            step=len(pixels) // height,
            data=self._node.octets(pixels),
        )
        stamp = self._node.now()
        self._images.publish(_stamped(message, self._frame, stamp))
        info = sensor_msgs.CameraInfo(height=height, width=width, distortion_model="plumb_bob")
        for name, matrix in readings.pinhole(width, height, self._settings.get("focal")).items():
            setattr(info, name if hasattr(info, name) else name.lower(), matrix)  # K is k in ROS 2
        self._infos.publish(_stamped(info, self._frame, stamp))


_KINDS: Mapping[str, Callable[[Node, Sensor, Frames], SensorTopics]] = {
    "range": RangeTopics,
    "raw": RawTopic,
    "quantity": QuantityTopic,
    "imu": ImuTopic,
    "magnetic": MagneticTopic,
    "battery": BatteryTopic,
    "temperature": TemperatureTopic,
    "image": ImageTopics,
}
_WITHOUT_SENSOR_MSGS = ("raw", "quantity", "range")


def topics_of(node: Node, config: Config, frames: Frames) -> dict[str, SensorTopics]:
    """Returns the topics of every enabled sensor for which this host has messages, by its name."""
    return {
        one.name: _KINDS[one.kind](node, one, frames)
        for one in config.sensors
        if one.rate > 0 and one.kind in _KINDS and (sensor_msgs or one.kind in _WITHOUT_SENSOR_MSGS)
    }


def retime(topics: Mapping[str, SensorTopics], config: Config) -> None:
    """Applies other rates to what messages have of them."""
    for sensor in config.sensors:
        of_sensor = topics.get(sensor.name)
        if isinstance(of_sensor, RangeTopics) and of_sensor.scan is not None:
            of_sensor.scan.period = 1 / sensor.rate


def _labelled(message: Any, names: Sequence[str]) -> Any:
    message.layout.dim = [
        MultiArrayDimension(label=",".join(names), size=len(message.data), stride=len(message.data))
    ]
    return message


def _stamped(message: Any, frame: str, stamp: Any) -> Any:
    message.header.stamp = stamp
    message.header.frame_id = frame
    return message


def _put(target: Any, vector: readings.Vector) -> None:
    target.x, target.y, target.z = vector
