"""A robot type as frozen models: link, kinematics, protocol, sensors, actuators, settings.

Quantities are SI and REP-103 (x forward, y left, angles counter-clockwise) unless the key names another unit.
Knows nothing of swarms.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from swarmctl.field_types import Baud, ConsistencyError, FilePath, Model, Printable, fits_together
from swarmctl.links.link_kinds import LineKind
from swarmctl.robot_types.actuators import Actuator
from swarmctl.robot_types.consistency import inconsistencies
from swarmctl.robot_types.kinematics import Kinematics
from swarmctl.robot_types.protocols import DriverProtocol, Protocol, RosserialProtocol
from swarmctl.robot_types.sensors import Sensor, SensorName
from swarmctl.robot_types.settings import NO_SETTINGS, RobotSettings
from swarmctl.units import Unit

Text = Annotated[Printable, Field(max_length=200)]


class Link(Model):
    """The line to the robot. No flow control, on any of them."""

    kinds: Annotated[tuple[LineKind, ...], Field(min_length=1, strict=False)] = Field(
        description="What the robot can be connected by."
    )
    baud: Baud = Field(description="Bits per second, unless the link sets it.")
    other_bauds: Annotated[tuple[Baud, ...], Field(strict=False)] = Field(
        (),
        examples=[[9600, 38400]],
        description="Other rates that a selector or a setting of the robot allows.",
    )
    bytesize: Literal[7, 8] = Field(8, description="Data bits.")
    parity: Literal["none", "even", "odd"] = Field("none", description="Parity bit.")
    stopbits: Literal[1, 2] = Field(1, description="Stop bits.")
    rfcomm_channel: int = Field(
        1, ge=1, le=30, description="Bluetooth serial channel, unless the link sets it."
    )
    settle: Annotated[float, Unit("s")] = Field(
        0.1, ge=0, le=10, description="Time between opening the line and the first request."
    )
    hint: Text = Field(
        "",
        examples=["check that the robot is switched on"],
        description="What to check when the robot does not answer; shown with the error.",
    )

    @property
    def bits(self) -> int:
        """What a byte takes on the line, with its start, parity and stop bits."""
        return 1 + self.bytesize + (self.parity != "none") + self.stopbits


class RobotType(Model):
    """One kind of robot with a protocol of its own, which swarmctl's driver knows."""

    title: Text = Field(examples=["K-Team Khepera III"], description="What people call it.")
    link: Link = Field(description="The line to it.")
    kinematics: Kinematics = Field(
        examples=[
            {
                "wheel_separation": 0.088,
                "wheel_speed_max": 0.3,
                "scales": [{"speed_units_per_mps": 218720, "metres_per_count": 3.0678e-5}],
            }
        ],
        description="How it moves.",
    )
    protocol: Protocol = Field(description="Its requests and replies.")
    sensors: dict[SensorName, Sensor] = Field(
        default_factory=dict,
        examples=[{"odom": {"kind": "wheels", "read": "position"}}],
        description="What it senses, by the name of the topic. Position counters are called `odom`.",
    )
    actuators: dict[SensorName, Actuator] = Field(
        default_factory=dict,
        examples=[{"leds": {"send": "L,{index},{value}", "reply": "l", "channels": ["left"], "max": 1}}],
        description="What may be set on it beside its speed, by the name of the topic.",
    )
    urdf: FilePath | None = Field(
        None,
        examples=["urdf/rover.urdf"],
        description="A URDF with its shape, by its path from the spec's folder; by default one is made from "
        "this type.",
    )
    firmware_dead_man: bool = Field(description="Whether the robot stops by itself when commands stop.")
    settings: RobotSettings = Field(
        default_factory=lambda: NO_SETTINGS, description="What differs from swarmctl's own defaults."
    )

    @property
    def driver_protocol(self) -> DriverProtocol | None:
        """The protocol of swarmctl's driver; None for a robot whose board speaks rosserial."""
        return self.protocol if not isinstance(self.protocol, RosserialProtocol) else None

    @property
    def sketch(self) -> RosserialProtocol | None:
        """What runs on its board."""
        return self.protocol if isinstance(self.protocol, RosserialProtocol) else None

    @fits_together
    def _fits_together(self) -> Iterator[ConsistencyError]:
        yield from inconsistencies(self)
