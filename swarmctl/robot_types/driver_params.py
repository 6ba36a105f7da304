"""What the driver of one robot reads: its type with the robot's settings worked in, as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from swarmctl.robot_types.effective_settings import command_timeout_of, equipped, rates_of, waits_of
from swarmctl.robot_types.kinematics import Scale
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import DIAGNOSTICS, RobotSettings
from swarmctl.robot_types.sketch_settings import completed


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
