"""What the fakes of rospy and rclpy share: messages, and the process at the other end of stdin and stdout.

Commands come in on stdin, one ``<sender> <m/s> <rad/s>`` a line, with the time in s behind it if it is
stamped, settings as ``<sender> <topic>=<numbers>``, messages of any other kind as ``<topic>:<bytes in hex>``,
and what else happens as one word (see ``listen``).
Publications go out on stdout, one JSON object a line. FAKE_LISTENERS=0 in the environment: nobody listens.
FAKE_LACKS names a package that is not installed.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import types
from array import array
from collections.abc import Callable, Mapping
from typing import Any

_PRINTING = threading.Lock()


def say(news: dict[str, Any]) -> None:
    """One line at a time: several threads publish."""
    line = json.dumps(news, default=_plain) + "\n"
    with _PRINTING:
        sys.stdout.write(line)
        sys.stdout.flush()


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, (bytes, array)) else vars(value)


class Message:
    """Any message: fields come into being when they are used."""

    OK, WARN, ERROR = range(3)  # of diagnostic_msgs/DiagnosticStatus

    def __init__(self, **fields: Any) -> None:
        self.__dict__.update(fields)

    def __getattr__(self, name: str) -> Message:
        if name.startswith("__"):
            raise AttributeError(name)
        return self.__dict__.setdefault(name, Message())


class Twist(Message):
    """A type of its own: ROS connects it with no other."""


class TwistStamped(Message):
    """Another one."""


class Stamp(float):
    """Seconds, as rospy and as rclpy have them in a header; as rclpy has a moment."""

    def to_sec(self) -> float:
        return float(self)

    def to_msg(self) -> Stamp:
        return self

    @property
    def nanoseconds(self) -> int:
        return int(self * 1e9)

    @property
    def sec(self) -> int:
        return int(self)

    @property
    def nanosec(self) -> int:
        return self.nanoseconds % 10**9


def packages(package: str, *names: str) -> None:
    if package == os.environ.get("FAKE_LACKS"):
        return
    module = types.ModuleType(f"{package}.msg")
    module.__dict__.update(dict.fromkeys(names, Message))
    sys.modules.update({package: types.ModuleType(package), f"{package}.msg": module})


packages("diagnostic_msgs", "DiagnosticArray", "DiagnosticStatus", "KeyValue")
packages("geometry_msgs", "Quaternion", "TransformStamped", "Vector3")
sys.modules["geometry_msgs.msg"].__dict__.update(Twist=Twist, TwistStamped=TwistStamped)
packages("nav_msgs", "Odometry")
packages("rcl_interfaces", "ParameterDescriptor", "SetParametersResult")
packages(
    "sensor_msgs",
    "BatteryState",
    "CameraInfo",
    "Image",
    "Imu",
    "JointState",
    "LaserScan",
    "MagneticField",
    "Range",
    "Temperature",
)
packages(
    "std_msgs",
    "Float32MultiArray",
    "MultiArrayDimension",
    "String",
    "UInt8",
    "UInt8MultiArray",
    "UInt16MultiArray",
)
packages("tf2_msgs", "TFMessage")


def listen(acts: Mapping[str, Callable[[], None]], deliver: Callable[[str, str, Any], None]) -> None:
    """Starts to read stdin; ``deliver`` takes the topic, the sender and the message, or bytes of one.

    ``acts``: what a line of one word does.
    """
    threading.Thread(target=_listen, args=(acts, deliver), daemon=True).start()


def _listen(acts: Mapping[str, Callable[[], None]], deliver: Callable[[str, str, Any], None]) -> None:
    say({"topic": "listening"})
    for line in sys.stdin:
        if line.strip() in acts:
            acts[line.strip()]()
        elif "=" in line:
            what, _, numbers = line.strip().partition("=")
            sender, topic = what.split()
            values = [int(number) for number in numbers.split(",")]
            deliver(topic, sender, Message(data=bytes(values) if len(values) > 1 else values[0]))
        elif ":" in line:
            topic, _, data = line.strip().partition(":")
            deliver(topic, "somebody", bytes.fromhex(data))
        else:
            sender, linear, angular, *stamp = line.split()
            twist = Twist(linear=_vector(x=float(linear)), angular=_vector(z=float(angular)))
            stamps = [Message(stamp=Stamp(one)) for one in stamp]
            deliver("cmd_vel", sender, TwistStamped(header=stamps[0], twist=twist) if stamps else twist)


def _vector(x: float = 0.0, z: float = 0.0) -> Message:
    return Message(x=x, y=0.0, z=z)


def listeners() -> int:
    """Returns how many nodes subscribe to any topic."""
    return int(os.environ.get("FAKE_LISTENERS", "1"))
