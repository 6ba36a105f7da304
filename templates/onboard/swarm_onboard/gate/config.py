"""The parameter file of one gate as frozen values. Written by swarmctl, readable by people."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Mapping

from swarm_onboard.command.authority import Commander, commander_of
from swarm_onboard.command.battery_watch import NO_LIMITS, BatteryLimits, battery_limits_of
from swarm_onboard.command.start import Start, start_of
from swarm_onboard.common.parameters import between, loaded, one_of, positive
from swarm_onboard.gate.motion import AXES, Motion
from swarm_onboard.ros.node import COMMAND_TYPES

NODE = "gate"
COMMAND = "cmd_vel"  # in the robot's namespace, as the next
OUTPUT = "gate/cmd_vel"


@dataclass(frozen=True)
class Config:
    """The parameter file of a gate. ``rate``: how often the command in force is repeated, Hz."""

    robot: str
    title: str
    namespace: str
    command_type: str
    output_type: str
    command_timeout: float
    rate: float
    diagnostics_rate: float
    commanders: tuple[Commander, ...]
    motion: Motion
    odom_frame: str  # of the driver
    start: Start | None = None  # where that frame lies in `map`
    stop_file: str = ""  # the latch of `swarmctl stop`
    odometry: str = ""  # the topic of the driver's odometry, if it publishes any
    battery: str = ""  # that of its battery
    docked: str = ""  # that of whether it is docked
    battery_limits: BatteryLimits = NO_LIMITS

    @property
    def node(self) -> str:
        """The full name of the gate's node."""
        return f"{self.namespace}/{NODE}"

    @property
    def command(self) -> str:
        """The full name of the topic on which commands come in."""
        return f"{self.namespace}/{COMMAND}"

    @property
    def output(self) -> str:
        """The full name of the topic on which they go out."""
        return f"{self.namespace}/{OUTPUT}"


def load(path: Path) -> Config:
    """Returns the parameters in the file ``path``. Raises ``ConfigError``."""
    return loaded(path, parse)


def parse(data: Mapping[str, Any]) -> Config:
    """Returns the parameters in ``data``. Raises KeyError, TypeError or ValueError."""
    return Config(
        robot=str(data["robot"]),
        title=str(data["title"]),
        namespace=str(data["namespace"]),
        command_type=one_of("command_type", data["command_type"], COMMAND_TYPES),
        output_type=one_of("output_type", data["output_type"], COMMAND_TYPES),
        command_timeout=between("command_timeout", data["command_timeout"], 0.05, 2.0),
        rate=between("rate", data["rate"], 1.0, 50.0),
        diagnostics_rate=between("diagnostics_rate", data["diagnostics_rate"], 0.2, 10.0),
        commanders=tuple(commander_of(one) for one in data["commanders"]),
        motion=_motion(data["motion"]),
        odom_frame=str(data["odom_frame"]),
        start=start_of(data["start"]) if "start" in data else None,
        stop_file=str(data.get("stop_file", "")),
        odometry=str(data.get("odometry", "")),
        battery=str(data.get("battery", "")),
        docked=str(data.get("docked", "")),
        battery_limits=battery_limits_of(data["battery_limits"]) if "battery_limits" in data else NO_LIMITS,
    )


def _motion(data: Mapping[str, Any]) -> Motion:
    kind = one_of("kind", data["kind"], tuple(AXES))
    lateral, vertical = (axis in AXES[kind] for axis in ("left", "up"))
    return Motion(
        kind=kind,
        linear_max=positive("linear_max", data["linear_max"]),
        lateral_max=positive("lateral_max", data["lateral_max"]) if lateral else 0.0,
        vertical_max=positive("vertical_max", data["vertical_max"]) if vertical else 0.0,
        angular_max=positive("angular_max", data["angular_max"]),
        wheel_separation=_optional("wheel_separation", data),
        turning_radius=_optional("turning_radius", data),
    )


def _optional(name: str, data: Mapping[str, Any]) -> float | None:
    return positive(name, data[name]) if data.get(name) is not None else None
