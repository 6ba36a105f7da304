from collections.abc import Sequence

from geometry_msgs.msg import Quaternion, Vector3
from rospy import Message
from std_msgs.msg import Header

class BatteryState(Message):
    header: Header
    voltage: float
    percentage: float
    present: bool
    power_supply_status: int
    temperature: float
    current: float
    charge: float
    capacity: float
    design_capacity: float
    def __init__(
        self,
        *,
        voltage: float = ...,
        percentage: float = ...,
        present: bool = ...,
        temperature: float = ...,
        current: float = ...,
        charge: float = ...,
        capacity: float = ...,
        design_capacity: float = ...,
    ) -> None: ...

class Image(Message):
    header: Header
    height: int
    width: int
    encoding: str
    step: int
    data: bytes
    def __init__(
        self, *, height: int = ..., width: int = ..., encoding: str = ..., step: int = ..., data: bytes = ...
    ) -> None: ...

class Imu(Message):
    header: Header
    orientation: Quaternion
    orientation_covariance: Sequence[float]
    angular_velocity: Vector3
    angular_velocity_covariance: Sequence[float]
    linear_acceleration: Vector3
    linear_acceleration_covariance: Sequence[float]
    def __init__(self, *, orientation_covariance: Sequence[float] = ...) -> None: ...

class JointState(Message):
    header: Header
    name: Sequence[str]
    position: Sequence[float]
    velocity: Sequence[float]
    def __init__(
        self, *, name: Sequence[str] = ..., position: Sequence[float] = ..., velocity: Sequence[float] = ...
    ) -> None: ...

class Joy(Message):
    header: Header
    axes: Sequence[float]
    buttons: Sequence[int]

class MagneticField(Message):
    header: Header
    magnetic_field: Vector3

class Range(Message):
    header: Header
    radiation_type: int
    field_of_view: float
    min_range: float
    max_range: float
    range: float
    def __init__(
        self,
        *,
        radiation_type: int = ...,
        field_of_view: float = ...,
        min_range: float = ...,
        max_range: float = ...,
        range: float = ...,
    ) -> None: ...

class Temperature(Message):
    header: Header
    temperature: float
    def __init__(self, *, temperature: float = ...) -> None: ...
