"""A robot type with the settings of one robot: what its driver does then, and how long it waits."""

from __future__ import annotations

from collections.abc import Mapping

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
