from collections.abc import Sequence

from rospy import Message
from std_msgs.msg import Header

class Vector3(Message):
    x: float
    y: float
    z: float
    def __init__(self, x: float = ..., y: float = ..., z: float = ...) -> None: ...

class Point(Message):
    x: float
    y: float
    z: float

class Quaternion(Message):
    x: float
    y: float
    z: float
    w: float
    def __init__(self, x: float = ..., y: float = ..., z: float = ..., w: float = ...) -> None: ...

class Twist(Message):
    linear: Vector3
    angular: Vector3

class TwistStamped(Message):
    header: Header
    twist: Twist

class TwistWithCovariance(Message):
    twist: Twist
    covariance: Sequence[float]

class Pose(Message):
    position: Point
    orientation: Quaternion

class PoseWithCovariance(Message):
    pose: Pose
    covariance: Sequence[float]

class Transform(Message):
    translation: Vector3
    rotation: Quaternion

class TransformStamped(Message):
    header: Header
    child_frame_id: str
    transform: Transform
    def __init__(self, *, child_frame_id: str = ...) -> None: ...
