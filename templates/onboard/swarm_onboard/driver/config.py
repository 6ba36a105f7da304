"""The parameter file of one driver as frozen values. Written by swarmctl, readable by people."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Mapping

from swarm_onboard.command.authority import Commander, commander_of
from swarm_onboard.command.battery_watch import BatteryLimits, battery_limits_of
from swarm_onboard.command.start import Start, start_of
from swarm_onboard.common.parameters import between, content_of, one_of, parsed, positive
from swarm_onboard.driver.live_values import fixed, shown_params
from swarm_onboard.driver.protocols import Protocol, protocol_of
from swarm_onboard.ros.node import COMMAND_TYPES

_WARNS = BatteryLimits(low=0.15)  # of robots without limits of their own: reported, never stopped


@dataclass(frozen=True)
class Serial:
    """The line. ``settle`` is the time between opening it and the first request, s."""

    baud: int
    bytesize: int
    parity: str
    stopbits: int
    settle: float
    hint: str


@dataclass(frozen=True)
class Scale:
    """The robot's own units, for firmware older than ``firmware_below``."""

    firmware_below: float
    speed_units_per_mps: float
    metres_per_count: float


@dataclass(frozen=True)
class Kinematics:
    """A differential drive: metres, m/s, rad/s. Errors are standard deviations per metre and radian."""

    wheel_separation: float
    wheel_speed_max: float
    wheel_speed_min: float
    linear_max: float
    angular_max: float
    counter_bits: int
    linear_error: float
    angular_error: float
    scales: tuple[Scale, ...]
    wheel_radius: float | None = None

    def scale_for(self, firmware: float | None) -> Scale | None:
        """Returns the units of a robot with that firmware; None if they depend on an unknown version."""
        if firmware is None:
            return self.scales[0] if len(self.scales) == 1 else None
        return next((scale for scale in self.scales if firmware < scale.firmware_below), None)


@dataclass(frozen=True)
class Sensor:
    """What is read, at ``rate`` Hz: ``count`` numbers from ``first`` on of the reply to the query ``read``.

    ``settings`` are those of its ``kind``, as the robot type has them.
    """

    name: str
    kind: str
    read: str
    first: int
    count: int
    rate: float
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Actuator:
    """What may be set beside the speed: a value from 0 to ``max`` for each channel.

    ``momentary`` is what is over by itself.
    """

    name: str
    send: str
    reply: str | None
    channels: tuple[str, ...]
    max: int
    momentary: bool

    @property
    def at_once(self) -> bool:
        """Whether one request sets all channels."""
        return "{values" in self.send


@dataclass(frozen=True)
class Config:
    """The parameter file of a driver."""

    robot: str
    title: str
    namespace: str
    frame_prefix: str
    port: str
    serial: Serial
    command_timeout: float
    command_type: str
    waits: Mapping[str, float]  # s for the answers that take a time of their own, by query
    firmware_of: Mapping[str, str]  # text that the firmware's name must have, by query
    commanders: tuple[Commander, ...]
    diagnostics_rate: float
    kinematics: Kinematics
    protocol: Protocol
    sensors: tuple[Sensor, ...]
    actuators: tuple[Actuator, ...]
    urdf: Path | None = None  # file with its shape
    start: Start | None = None
    stop_file: str = ""  # the latch of `swarmctl stop`
    battery_limits: BatteryLimits = _WARNS
    shown: Mapping[str, Any] = field(default_factory=dict)  # as ROS parameters
    fixed: Mapping[str, Any] = field(default_factory=dict)  # what a running driver does not take
    file: Path = Path()
    digest: str = ""  # SHA-256 of the file

    def readable(self, sensor: Sensor, firmware: str) -> bool:
        """Returns whether a robot with this ``firmware`` has the query of a sensor."""
        return self.firmware_of.get(sensor.read, "") in firmware

    def sensor(self, name: str) -> Sensor | None:
        """Returns the sensor of that name; None if it is off."""
        return next((one for one in self.sensors if one.name == name), None)


def load(path: Path) -> Config:
    """Returns the parameters in the file ``path``. Raises ``ConfigError``."""
    content = content_of(path)
    config = parsed(path, content, lambda data: parse(data, path.parent))
    return replace(config, file=path, digest=sha256(content).hexdigest())


def parse(data: Mapping[str, Any], folder: Path = Path()) -> Config:
    """Returns the parameters in ``data``; files that they name are relative to ``folder``.

    Raises KeyError, TypeError or ValueError if ``data`` is not what swarmctl writes.
    """
    return Config(
        robot=str(data["robot"]),
        title=str(data["title"]),
        namespace=str(data["namespace"]),
        frame_prefix=str(data["frame_prefix"]),
        port=str(data["port"]),
        serial=_serial(data["serial"]),
        command_timeout=between("command_timeout", data["command_timeout"], 0.05, 2.0),
        command_type=one_of("command_type", data.get("command_type", COMMAND_TYPES[0]), COMMAND_TYPES),
        waits={str(name): positive(f"waits.{name}", wait) for name, wait in data.get("waits", {}).items()},
        firmware_of={str(name): str(text) for name, text in data.get("firmware_of", {}).items()},
        commanders=tuple(commander_of(one) for one in data["commanders"]),
        diagnostics_rate=between("diagnostics_rate", data["diagnostics_rate"], 0.2, 10.0),
        kinematics=_kinematics(data["kinematics"]),
        protocol=protocol_of(data["protocol"], folder, data["kinematics"].get("wheel_radius")),
        sensors=tuple(_sensor(name, one) for name, one in data["sensors"].items()),
        actuators=tuple(_actuator(name, one) for name, one in data["actuators"].items()),
        urdf=folder / str(data["urdf"]) if "urdf" in data else None,
        start=start_of(data["start"]) if "start" in data else None,
        stop_file=str(data.get("stop_file", "")),
        battery_limits=battery_limits_of(data["battery_limits"]) if "battery_limits" in data else _WARNS,
        shown=shown_params(data),
        fixed=fixed(data),
    )


def _serial(data: Mapping[str, Any]) -> Serial:
    return Serial(
        baud=int(data["baud"]),
        bytesize=int(data["bytesize"]),
        parity=str(data["parity"]),
        stopbits=int(data["stopbits"]),
        settle=between("serial.settle", data["settle"], 0.0, 10.0),
        hint=str(data["hint"]),
    )


def _kinematics(data: Mapping[str, Any]) -> Kinematics:
    error = data["odometry_error"]
    return Kinematics(
        wheel_separation=positive("wheel_separation", data["wheel_separation"]),
        wheel_speed_max=positive("wheel_speed_max", data["wheel_speed_max"]),
        wheel_speed_min=between("wheel_speed_min", data["wheel_speed_min"], 0.0, data["wheel_speed_max"]),
        linear_max=positive("linear_max", data["linear_max"]),
        angular_max=positive("angular_max", data["angular_max"]),
        counter_bits=int(data["counter_bits"]),
        linear_error=positive("odometry_error.linear", error["linear"]),
        angular_error=positive("odometry_error.angular", error["angular"]),
        scales=tuple(_scale(scale) for scale in data["scales"]),
        wheel_radius=positive("wheel_radius", data["wheel_radius"]) if "wheel_radius" in data else None,
    )


def _scale(data: Mapping[str, Any]) -> Scale:
    return Scale(
        firmware_below=float(data.get("firmware_below", math.inf)),
        speed_units_per_mps=positive("speed_units_per_mps", data["speed_units_per_mps"]),
        metres_per_count=positive("metres_per_count", data["metres_per_count"]),
    )


def _sensor(name: str, data: Mapping[str, Any]) -> Sensor:
    own = ("kind", "read", "first", "count", "rate")
    return Sensor(
        name=str(name),
        kind=str(data["kind"]),
        read=str(data["read"]),
        first=int(data["first"]),
        count=int(data["count"]),
        rate=between(f"sensors.{name}.rate", data["rate"], 0.0, 50.0),
        settings={key: value for key, value in data.items() if key not in own},
    )


def _actuator(name: str, data: Mapping[str, Any]) -> Actuator:
    reply = data.get("reply")
    return Actuator(
        name=str(name),
        send=str(data.get("send", "")),
        reply=None if reply is None else str(reply),
        channels=tuple(str(one) for one in data["channels"]),
        max=int(data["max"]),
        momentary=bool(data["momentary"]),
    )
