"""Pose, speed and wheel motion of a robot as messages of ROS."""

from __future__ import annotations

from typing import Any

from nav_msgs.msg import Odometry

from swarm_onboard.command.transforms import TFMessage, transform, turned_by
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.frames import Frames
from swarm_onboard.driver.kinematics import Pose
from swarm_onboard.ros.node import Kind, Node

JointState: Any
try:
    from sensor_msgs.msg import JointState
except ImportError:  # a host without sensor_msgs gets no joints
    JointState = None

_JOINTS = ("left_wheel", "right_wheel")  # as in the URDF; their namespace says whose they are
_UNKNOWN = 1e6  # variance of what a robot on wheels cannot know
_AT_REST = 1e-6  # variance of what has not gone astray yet


class MotionTopics:
    """`odom`, the transform to it, and `joint_states` where the wheels' radius is known."""

    def __init__(self, node: Node, config: Config, frames: Frames) -> None:
        self._node = node
        self._kinematics = config.kinematics
        self._frames = frames
        self._radius = config.kinematics.wheel_radius
        self._odom = node.publisher("odom", Odometry, Kind.STATE)
        self._tf = node.publisher("/tf", TFMessage, Kind.STATE) if TFMessage else None
        joints = self._radius is not None and JointState is not None
        self._joints = node.publisher("joint_states", JointState, Kind.STATE) if joints else None

    def publish(self, pose: Pose) -> None:
        """Publishes the pose on all topics, with one stamp."""
        stamp = self._node.now()
        self._odom.publish(self._odometry(pose, stamp))
        if self._tf is not None:
            place = (pose.x, pose.y, 0.0)
            moved = transform(self._frames.odom, self._frames.base, place, turned_by(pose.yaw), stamp)
            self._tf.publish(TFMessage(transforms=[moved]))
        if self._joints is not None and self._radius is not None:
            self._joints.publish(self._joint_state(pose, self._radius, stamp))

    def _odometry(self, pose: Pose, stamp: Any) -> Any:
        message = Odometry()
        message.header.stamp = stamp
        message.header.frame_id = self._frames.odom
        message.child_frame_id = self._frames.base
        message.pose.pose.position.x = pose.x
        message.pose.pose.position.y = pose.y
        message.pose.pose.orientation = turned_by(pose.yaw)
        message.twist.twist.linear.x = pose.linear
        message.twist.twist.angular.z = pose.angular
        errors = self._kinematics
        yaw_error = errors.angular_error * pose.turned
        # A wrong heading bends the whole way that follows it, so it spoils the place as well.
        place_error = errors.linear_error * pose.driven + min(1.0, yaw_error) * pose.driven
        message.pose.covariance = _covariance(place_error, place_error, yaw_error)
        message.twist.covariance = _covariance(
            errors.linear_error * pose.linear, 0.0, errors.angular_error * pose.angular
        )
        return message

    def _joint_state(self, pose: Pose, radius: float, stamp: Any) -> Any:
        half = pose.angular * self._kinematics.wheel_separation / 2
        message = JointState(
            name=list(_JOINTS),
            position=[pose.left / radius, pose.right / radius],
            velocity=[(pose.linear - half) / radius, (pose.linear + half) / radius],
        )
        message.header.stamp = stamp
        return message


def _covariance(x: float, y: float, yaw: float) -> list[float]:
    """Returns the 6 x 6 matrix of a planar pose or twist, from standard deviations."""
    variances = (x * x + _AT_REST, y * y + _AT_REST, _UNKNOWN, _UNKNOWN, _UNKNOWN, yaw * yaw + _AT_REST)
    return [variances[row] if row == column else 0.0 for row in range(6) for column in range(6)]
