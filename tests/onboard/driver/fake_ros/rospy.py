"""As much of rospy as the nodes of a driver and a gate touch, without a master.

Commands come in on stdin, one ``<sender> <m/s> <rad/s>`` a line, settings as ``<topic>=<numbers>``,
messages of any other kind as ``<topic>:<bytes in hex>``, and ``shutdown`` as the end by ROS. Publications go
out on stdout, one JSON object a line. With FAKE_MASTER=away in the environment no node ever joins;
FAKE_LISTENERS=0 says that nobody listens, FAKE_LACKS names a package that is not installed.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
import time
import types
from typing import Any, ClassVar

_PRINTING = threading.Lock()


def _say(news: dict[str, Any]) -> None:
    """One line at a time: several threads publish."""
    line = json.dumps(news, default=_plain) + "\n"
    with _PRINTING:
        sys.stdout.write(line)
        sys.stdout.flush()


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, bytes) else vars(value)


class Message:
    """Any message: fields come into being when they are used."""

    def __init__(self, *values: Any, **fields: Any) -> None:
        self.__dict__.update({str(number): value for number, value in enumerate(values)}, **fields)

    def __getattr__(self, name: str) -> Message:
        if name.startswith("__"):
            raise AttributeError(name)
        return self.__dict__.setdefault(name, Message())


def _messages(package: str, *names: str) -> None:
    if package == os.environ.get("FAKE_LACKS"):
        return
    module = types.ModuleType(f"{package}.msg")
    module.__dict__.update(dict.fromkeys(names, Message))
    sys.modules.update({package: types.ModuleType(package), f"{package}.msg": module})


_messages("diagnostic_msgs", "DiagnosticArray", "DiagnosticStatus", "KeyValue")
_messages("geometry_msgs", "Quaternion", "TransformStamped", "Twist", "TwistStamped", "Vector3")
_messages("nav_msgs", "Odometry")
_messages(
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
_messages(
    "std_msgs", "Float32MultiArray", "MultiArrayDimension", "UInt8", "UInt8MultiArray", "UInt16MultiArray"
)
_messages("tf2_msgs", "TFMessage")


def init_node(name: str, disable_signals: bool) -> None:
    while os.environ.get("FAKE_MASTER") == "away":
        time.sleep(0.1)


def get_name() -> str:
    return "/driver"


def set_param(name: str, value: Any) -> None:
    _say({"topic": "parameter", "name": name, "value": value})


_HOOKS: list[Any] = []


def on_shutdown(hook: Any) -> None:
    """Runs when the test writes the line ``shutdown``, as for a node that another one replaces."""
    _HOOKS.append(hook)


def signal_shutdown(reason: str) -> None:
    _say({"topic": "shutdown", "reason": reason})


class Time:
    now = staticmethod(time.time)


class AnyMsg:
    """A message whose bytes nobody looks into."""

    _buff: bytes


class SubscribeListener:
    """Is never called: everybody listens from the beginning."""


class Publisher:
    def __init__(self, topic: str, data_class: Any, **_: Any) -> None:
        self.data_class = data_class
        self._topic = topic

    def publish(self, message: Message | AnyMsg) -> None:
        if isinstance(message, AnyMsg):
            kind = type(message)
            _say({"topic": self._topic, "is": [kind._type, kind._md5sum], "bytes": message._buff.hex()})
            return
        _say({"topic": self._topic, **vars(message)})

    def unregister(self) -> None:
        _say({"topic": "no more", "name": self._topic})

    def get_num_connections(self) -> int:
        return int(os.environ.get("FAKE_LISTENERS", "1"))


class Subscriber:
    """Each sender has a thread of its own, as rospy has it."""

    subscribers: ClassVar[dict[str, Subscriber]] = {}

    def __init__(self, topic: str, _type: Any, take: Any, **__: Any) -> None:
        self._topic, self._take = topic, take
        self._connections: dict[str, queue.Queue[Any]] = {}
        self.subscribers[topic] = self
        if len(self.subscribers) == 1:
            threading.Thread(target=_listen, daemon=True).start()
        _say({"topic": "subscribes", "name": topic})

    def unregister(self) -> None:
        del self.subscribers[self._topic]
        _say({"topic": "no more", "name": self._topic})

    def deliver(self, sender: str, message: Message | AnyMsg) -> None:
        if sender not in self._connections:
            self._connections[sender] = queue.Queue()
            threading.Thread(target=self._receive, args=(self._connections[sender],), daemon=True).start()
        self._connections[sender].put(message)

    def _receive(self, connection: queue.Queue[Any]) -> None:
        while True:
            self._take(connection.get())


def _listen() -> None:
    _say({"topic": "listening"})
    for line in sys.stdin:
        if line == "shutdown\n":
            for hook in _HOOKS:
                hook()
            continue
        if "=" in line:
            topic, _, numbers = line.strip().partition("=")
            values = [int(number) for number in numbers.split(",")]
            message = Message(data=bytes(values) if len(values) > 1 else values[0])
            Subscriber.subscribers[topic].deliver("somebody", message)
            continue
        if ":" in line:
            topic, _, data = line.strip().partition(":")
            anything = AnyMsg()
            anything._buff = bytes.fromhex(data)
            Subscriber.subscribers[topic].deliver("somebody", anything)
            continue
        sender, linear, angular = line.split()
        message = Message(
            linear=_vector(x=float(linear)),
            angular=_vector(z=float(angular)),
            _connection_header={"callerid": sender},
        )
        Subscriber.subscribers["cmd_vel"].deliver(sender, message)


def _vector(x: float = 0.0, z: float = 0.0) -> Message:
    return Message(x=x, y=0.0, z=z)
