"""What the driver of one robot reads: its type with the robot's settings worked in, as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from swarmctl.robot_types.kinematics import Scale
from swarmctl.robot_types.protocols import BinaryProtocol, length_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import (
    COMMAND_TIMEOUT,
    DIAGNOSTICS,
    DIAGNOSTICS_RATE,
    RobotSettings,
    last_rate,
    merged,
)
from swarmctl.robot_types.sketch_settings import completed

SHORTEST_WATCHDOG = 1.0  # s
_LONGEST_NUMBER = len("-2147483648")


def rates_of(robot_type: RobotType, *layers: RobotSettings) -> dict[str, float]:
    """Returns how often a driver reads and publishes each sensor, Hz; 0 is off.

    ``layers`` as for ``merged``.
    """
    rates = {name: last_rate(one.rate, name, layers) for name, one in robot_type.sensors.items()}
    return {**rates, DIAGNOSTICS: last_rate(DIAGNOSTICS_RATE, DIAGNOSTICS, layers)}


def command_timeout_of(*layers: RobotSettings) -> float:
    """Seconds without a command after which a robot is stopped. ``layers`` as for ``merged``."""
    declared = (one.command_timeout for one in reversed(layers) if one.command_timeout is not None)
    return float(next(declared, COMMAND_TIMEOUT))


def command_type_of(*layers: RobotSettings) -> str | None:
    """The message type of the commands of a robot, where one has it. ``layers`` as for ``merged``."""
    return next((one.command_type for one in reversed(layers) if one.command_type is not None), None)


def equipped(robot_type: RobotType, *layers: RobotSettings) -> RobotType:
    """Returns the type with its tuned sensors and the requests of its protocol that follow from them."""
    tuned = {name: one for name, one in robot_type.sensors.items() if one.settings_key}
    protocol = robot_type.protocol
    if not tuned or not isinstance(protocol, BinaryProtocol):
        return robot_type
    settings = merged(*layers)
    for name, built in tuned.items():
        tuned[name] = sensor = built.tuned(settings)
        on = last_rate(sensor.rate, name, layers) > 0
        protocol = sensor.prepared(protocol, sensor.read or name, on=on)
    return robot_type.model_copy(update={"sensors": {**robot_type.sensors, **tuned}, "protocol": protocol})


def waits_of(robot_type: RobotType, baud: int, rates: Mapping[str, float]) -> dict[str, float]:
    """How long a driver waits for the replies of queries with a `timeout` of their own, by query, s.

    ``robot_type`` is equipped; sensors that are off send no query.
    """
    protocol = robot_type.driver_protocol
    if protocol is None:
        return {}
    read = {one.read or name for name, one in robot_type.sensors.items() if rates[name] > 0}
    return {
        name: query.timeout + length_of(protocol, name, _LONGEST_NUMBER)[1] * robot_type.link.bits / baud
        for name, query in protocol.queries.items()
        if query.timeout is not None and name in read
    }


def watchdog_of(robot_type: RobotType, baud: int, *layers: RobotSettings) -> float:
    """Watchdog timeout of a driver, s; the driver notifies systemd every two exchanges."""
    protocol = robot_type.driver_protocol
    if protocol is None:
        return SHORTEST_WATCHDOG
    waits = waits_of(equipped(robot_type, *layers), baud, rates_of(robot_type, *layers))
    longest = max((protocol.reply_timeout, *waits.values()))
    return max(SHORTEST_WATCHDOG, 2 * (protocol.reply_timeout + longest))


def params_of(
    robot_type: RobotType,
    *,
    robot: str,
    namespace: str,
    port: str,
    settings: RobotSettings | None = None,
    baud: int | None = None,
    module: str = "",
) -> dict[str, Any]:
    """The parameter file of one robot, whose ``settings`` are merged already.

    ``module`` is where the file with its protocol class will be, seen from that file, if its type has one.
    """
    own = own_params(robot_type, robot=robot, namespace=namespace, port=port)
    return own | common_params(robot_type, settings or robot_type.settings, baud, module)


def own_params(robot_type: RobotType, *, robot: str, namespace: str, port: str) -> dict[str, Any]:
    """The part of the parameter file that differs between any two robots."""
    return {
        "robot": robot,
        "title": robot_type.title,
        "namespace": namespace,
        "frame_prefix": namespace.strip("/") + "/",
        "port": port,
    }


def common_params(
    robot_type: RobotType, tuned: RobotSettings, baud: int | None, module: str
) -> dict[str, Any]:
    """The part of the parameter file that is equal for robots of one type with equal settings."""
    robot_type = equipped(robot_type, tuned)
    link, rates = robot_type.link, rates_of(robot_type, tuned)
    return {
        "serial": {
            "baud": baud or link.baud,
            "bytesize": link.bytesize,
            "parity": link.parity,
            "stopbits": link.stopbits,
            "settle": link.settle,
            "hint": link.hint,
        },
        "command_timeout": command_timeout_of(tuned),
        **({"waits": waits} if (waits := waits_of(robot_type, baud or link.baud, rates)) else {}),
        **({"firmware_of": needed} if (needed := _firmware_of(robot_type)) else {}),
        **({"battery_limits": tuned.battery.model_dump()} if tuned.battery else {}),
        "diagnostics_rate": rates[DIAGNOSTICS],
        "kinematics": _kinematics(robot_type, tuned),
        "protocol": _protocol(robot_type, tuned)
        | ({"module": module} if robot_type.protocol.kind == "python" else {}),
        "sensors": {
            name: _plain(one.model_dump(exclude_none=True, exclude=one.set_by))
            | {"read": one.read or name, "count": one.count, "rate": rates[name], **one.derived}
            for name, one in robot_type.sensors.items()
        },
        "actuators": {
            name: _plain(one.model_dump(exclude_none=True)) for name, one in robot_type.actuators.items()
        },
    }


def _protocol(robot_type: RobotType, tuned: RobotSettings) -> dict[str, Any]:
    params: dict[str, Any] = _plain(robot_type.protocol.model_dump(exclude_none=True))
    for query in params.get("queries", {}).values():
        query.pop("timeout", None)  # stands in `waits`
        query.pop("firmware", None)  # stands in `firmware_of`
    for exchange in (
        params.get("set_speed", {}),
        *params.get("setup", ()),
        *params.get("queries", {}).values(),
    ):
        if not exchange.get("begins"):
            exchange.pop("begins", None)
    if robot_type.sketch and robot_type.sketch.firmware and "odometry" in params:
        params["odometry"]["counts_per_turn"] = completed(tuned.firmware).pulses_per_turn
    return params


def _firmware_of(robot_type: RobotType) -> dict[str, str]:
    """The text that the firmware's name must have, by query."""
    protocol = robot_type.driver_protocol
    queries = protocol.queries if protocol is not None else {}
    return {name: one.firmware for name, one in queries.items() if one.firmware is not None}


def _kinematics(robot_type: RobotType, tuned: RobotSettings) -> dict[str, Any]:
    kinematics = robot_type.kinematics
    stretch = tuned.calibration.distance_scale or 1.0
    separation = tuned.calibration.wheel_separation or kinematics.wheel_separation
    wheel_speed = kinematics.wheel_speed_max * stretch
    radius = {} if kinematics.wheel_radius is None else {"wheel_radius": kinematics.wheel_radius * stretch}
    return radius | {
        "wheel_separation": separation,
        "wheel_speed_max": wheel_speed,
        "wheel_speed_min": kinematics.wheel_speed_min * stretch,
        "linear_max": min(tuned.limits.linear or math.inf, wheel_speed),
        "angular_max": min(tuned.limits.angular or math.inf, 2 * wheel_speed / separation),
        "counter_bits": kinematics.counter_bits,
        "odometry_error": kinematics.odometry_error.model_dump(),
        "scales": [_scaled(scale, stretch) for scale in kinematics.scales],
    }


def _scaled(scale: Scale, stretch: float) -> dict[str, Any]:
    """A wheel ``stretch`` times as large as believed: fewer units for a speed, more way for a count."""
    bound = {} if scale.firmware_below is None else {"firmware_below": scale.firmware_below}
    return bound | {
        "speed_units_per_mps": scale.speed_units_per_mps / stretch,
        "metres_per_count": scale.metres_per_count * stretch,
    }


def _plain(data: Any) -> Any:
    """The same data with tuples as lists, as YAML knows them."""
    if isinstance(data, Mapping):
        return {key: _plain(value) for key, value in data.items()}
    return [_plain(value) for value in data] if isinstance(data, (list, tuple)) else data
