"""The parameter file of one driver as frozen values. Written by swarmctl, readable by people."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Mapping

import yaml

from swarm_driver.authority import Commander


class ConfigError(Exception):
    """What is wrong with a parameter file, and where in it."""


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
class Rates:
    """Hz; 0 is off."""

    odom: float
    proximity: float
    diagnostics: float


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

    def scale_for(self, firmware: float | None) -> Scale | None:
        """The units of a robot with that firmware; none when they depend on a version that is not known."""
        if firmware is None:
            return self.scales[0] if len(self.scales) == 1 else None
        return next((scale for scale in self.scales if firmware < scale.firmware_below), None)


@dataclass(frozen=True)
class Query:
    """A request, and its reply: a head, ``values`` numbers, up to ``extra`` numbers that are ignored."""

    send: str
    reply: str
    values: int = 0
    extra: int = 0


@dataclass(frozen=True)
class Protocol:
    """What is said on the line. ``identify`` is answered with text."""

    terminator: str
    reply_timeout: float
    error_heads: tuple[str, ...]
    set_speed: Query
    read_position: Query | None
    read_proximity: Query | None
    identify: Query | None


@dataclass(frozen=True)
class Config:
    """Everything that a driver is told."""

    robot: str
    title: str
    namespace: str
    frame_prefix: str
    port: str
    serial: Serial
    command_timeout: float
    commanders: tuple[Commander, ...]
    rates: Rates
    kinematics: Kinematics
    protocol: Protocol
    proximity_names: tuple[str, ...]
    proximity_max: int


def load(path: Path) -> Config:
    """The parameters in ``path``, or a ``ConfigError`` that says what is wrong with them."""
    try:
        data = yaml.safe_load(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"cannot read {path}: {error}") from error
    try:
        return parse(data)
    except KeyError as error:
        raise ConfigError(f"{path}: the key {error} is missing") from error
    except (TypeError, ValueError, AttributeError) as error:
        raise ConfigError(f"{path}: {error}") from error


def parse(data: Mapping[str, Any]) -> Config:
    """The parameters in ``data``; KeyError, TypeError or ValueError when it is not what swarmctl writes."""
    protocol, proximity = data["protocol"], data["sensors"]["proximity"]
    if protocol["kind"] != "line":
        raise ValueError("this driver speaks lines of text, not `{}`".format(protocol["kind"]))
    return Config(
        robot=str(data["robot"]),
        title=str(data["title"]),
        namespace=str(data["namespace"]),
        frame_prefix=str(data["frame_prefix"]),
        port=str(data["port"]),
        serial=_serial(data["serial"]),
        command_timeout=_between("command_timeout", data["command_timeout"], 0.05, 2.0),
        commanders=tuple(_commander(one) for one in data["commanders"]),
        rates=_rates(data["rates"]),
        kinematics=_kinematics(data["kinematics"]),
        protocol=_protocol(protocol),
        proximity_names=tuple(str(name) for name in proximity["names"]),
        proximity_max=int(proximity["max_reading"]),
    )


def _commander(data: Mapping[str, Any]) -> Commander:
    return Commander(
        name=str(data["name"]),
        priority=int(data["priority"]),
        nodes=tuple(str(node) for node in data["nodes"]),
        namespace=str(data["namespace"]) if data["namespace"] is not None else None,
        addresses=tuple(str(address).lower() for address in data["addresses"]),
    )


def _serial(data: Mapping[str, Any]) -> Serial:
    return Serial(
        baud=int(data["baud"]),
        bytesize=int(data["bytesize"]),
        parity=str(data["parity"]),
        stopbits=int(data["stopbits"]),
        settle=_between("serial.settle", data["settle"], 0.0, 10.0),
        hint=str(data["hint"]),
    )


def _rates(data: Mapping[str, Any]) -> Rates:
    return Rates(
        odom=_between("rates.odom", data["odom"], 0.0, 50.0),
        proximity=_between("rates.proximity", data["proximity"], 0.0, 50.0),
        diagnostics=_between("rates.diagnostics", data["diagnostics"], 0.2, 10.0),
    )


def _kinematics(data: Mapping[str, Any]) -> Kinematics:
    error = data["odometry_error"]
    return Kinematics(
        wheel_separation=_positive("wheel_separation", data["wheel_separation"]),
        wheel_speed_max=_positive("wheel_speed_max", data["wheel_speed_max"]),
        wheel_speed_min=_between("wheel_speed_min", data["wheel_speed_min"], 0.0, data["wheel_speed_max"]),
        linear_max=_positive("linear_max", data["linear_max"]),
        angular_max=_positive("angular_max", data["angular_max"]),
        counter_bits=int(data["counter_bits"]),
        linear_error=_positive("odometry_error.linear", error["linear"]),
        angular_error=_positive("odometry_error.angular", error["angular"]),
        scales=tuple(_scale(scale) for scale in data["scales"]),
    )


def _scale(data: Mapping[str, Any]) -> Scale:
    return Scale(
        firmware_below=float(data.get("firmware_below", math.inf)),
        speed_units_per_mps=_positive("speed_units_per_mps", data["speed_units_per_mps"]),
        metres_per_count=_positive("metres_per_count", data["metres_per_count"]),
    )


def _protocol(data: Mapping[str, Any]) -> Protocol:
    queries: dict[str, Query | None] = {
        name: Query(**data[name]) if name in data else None
        for name in ("read_position", "read_proximity", "identify")
    }
    return Protocol(
        terminator=str(data["terminator"]),
        reply_timeout=_between("protocol.reply_timeout", data["reply_timeout"], 0.01, 2.0),
        error_heads=tuple(str(head) for head in data["error_heads"]),
        set_speed=Query(**data["set_speed"]),
        **queries,
    )


def _between(name: str, value: Any, low: float, high: float) -> float:
    number = float(value)
    if not low <= number <= high:
        raise ValueError(f"`{name}` must be from {low} to {high}, not {value}")
    return number


def _positive(name: str, value: Any) -> float:
    number = float(value)
    if not 0 < number < math.inf:
        raise ValueError(f"`{name}` must be greater than 0, not {value}")
    return number
