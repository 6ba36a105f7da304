"""Fills messages of the usual types with the pose and velocity of a body; others keep their zeros."""

from __future__ import annotations

import math
from typing import Any, Callable

from swarm_onboard.command.transforms import transform, turned_by
from swarm_onboard.stand_in.body import Axes, Body
from swarm_onboard.stand_in.config import Config

AnyMsg: Any
try:
    from rospy import AnyMsg
except ImportError:  # ROS 2
    AnyMsg = None


def untyped(kind: str) -> Any:
    """Returns a message class of that name without content; None in ROS 2.

    Its MD5 sum is the wildcard of rospy, so nodes that only count or look up the topic see it; no node with
    the real type connects.
    """
    if AnyMsg is None:
        return None
    empty = {"_type": kind, "_md5sum": AnyMsg._md5sum, "__init__": _without_content}
    return type(kind.rpartition("/")[2], (AnyMsg,), empty)


def _without_content(message: Any) -> None:
    AnyMsg.__init__(message)
    message._buff = b""


ODOMETRY = "nav_msgs/Odometry"
_BEAMS, _FAR = 360, 3.5  # of a laser that sees nothing, m
_GRAVITY = 9.81  # m/s2


def fill(message: Any, kind: str, config: Config, body: Body, now: Any) -> Any:
    """Returns ``message`` of type ``kind``, with the time ``now`` where it has a header."""
    if hasattr(message, "header"):
        message.header.stamp = now
        message.header.frame_id = config.frame_of("base_link")
    if kind in _FILLERS:
        _FILLERS[kind](message, config, body)
    return message


def odometry_transform(config: Config, body: Body, now: Any) -> Any:
    """Returns the geometry_msgs/TransformStamped from the odometry frame to the body."""
    pose = body.pose
    place, turned = (pose.x, pose.y, pose.z), turned_by(pose.theta)
    return transform(config.odom_frame, config.frame_of("base_link"), place, turned, now)


def _place(pose: Any, body: Body) -> None:
    pose.position.x, pose.position.y, pose.position.z = body.pose.x, body.pose.y, body.pose.z
    pose.orientation = turned_by(body.pose.theta)


def _move(twist: Any, velocity: Axes) -> None:
    twist.linear.x, twist.linear.y, twist.linear.z, twist.angular.z = velocity


def _odometry(message: Any, config: Config, body: Body) -> None:
    message.header.frame_id = config.odom_frame
    message.child_frame_id = config.frame_of("base_link")
    _place(message.pose.pose, body)
    _move(message.twist.twist, body.velocity)


def _pose(message: Any, config: Config, body: Body) -> None:
    message.header.frame_id = config.odom_frame
    _place(message.pose, body)


def _twist(message: Any, _config: Config, body: Body) -> None:
    _move(message.twist, body.velocity)


def _scan(message: Any, config: Config, _body: Body) -> None:
    message.header.frame_id = config.frame_of("base_scan")
    message.angle_min, message.angle_increment = 0.0, 2 * math.pi / _BEAMS
    message.angle_max = message.angle_increment * (_BEAMS - 1)
    message.range_min, message.range_max = 0.12, _FAR
    message.ranges = [math.inf] * _BEAMS


def _imu(message: Any, _config: Config, body: Body) -> None:
    message.orientation = turned_by(body.pose.theta)
    message.angular_velocity.z = body.velocity[3]
    message.linear_acceleration.z = _GRAVITY


def _battery(message: Any, _config: Config, _body: Body) -> None:
    message.voltage, message.percentage, message.present = 12.0, 0.8, True


def _joints(message: Any, config: Config, body: Body) -> None:
    forward, turn, half = body.velocity[0], body.velocity[3], config.wheel_separation / 2
    message.name = ["wheel_left_joint", "wheel_right_joint"]
    message.position = [0.0, 0.0]
    message.velocity = [forward - turn * half, forward + turn * half]


_FILLERS: dict[str, Callable[[Any, Config, Body], None]] = {
    ODOMETRY: _odometry,
    "geometry_msgs/PoseStamped": _pose,
    "geometry_msgs/TwistStamped": _twist,
    "sensor_msgs/BatteryState": _battery,
    "sensor_msgs/Imu": _imu,
    "sensor_msgs/JointState": _joints,
    "sensor_msgs/LaserScan": _scan,
}
