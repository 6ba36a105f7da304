"""A robot type as frozen models: how a robot is built, what its line is, what it says, senses and shows.

Quantities are SI and REP-103 (x forward, y left, angles counter-clockwise) unless the key names another unit.
Knows nothing of swarms.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from swarmctl.spec.actuators import Actuator
from swarmctl.spec.binary import BinaryQuery
from swarmctl.spec.misfits import misfits
from swarmctl.spec.protocols import Asked, DriverName, Protocol, RosserialProtocol
from swarmctl.spec.queries import CodedQuery, Query
from swarmctl.spec.sensors import Positive, Sensor, SensorName
from swarmctl.spec.settings import UNTUNED, Metres, RobotSettings, Speed
from swarmctl.spec.words import MisfitError, Model

_TEXT = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$"

Text = Annotated[str, Field(pattern=_TEXT, max_length=200)]


class Link(Model):
    """The line to the robot. No flow control, on any of them."""

    kinds: Annotated[tuple[Literal["serial", "bluetooth"], ...], Field(min_length=1, strict=False)] = Field(
        description="What the robot can be connected by."
    )
    baud: int = Field(
        ge=300,
        le=4_000_000,
        examples=[115200],
        description="Bits per second, unless the link says otherwise.",
    )
    other_bauds: Annotated[tuple[Annotated[int, Field(ge=300, le=4_000_000)], ...], Field(strict=False)] = (
        Field(
            (),
            examples=[[9600, 38400]],
            description="Other rates that a selector or a setting of the robot allows.",
        )
    )
    bytesize: Literal[7, 8] = Field(8, description="Data bits.")
    parity: Literal["none", "even", "odd"] = Field("none", description="Parity bit.")
    stopbits: Literal[1, 2] = Field(1, description="Stop bits.")
    rfcomm_channel: int = Field(
        1, ge=1, le=30, description="Bluetooth serial channel, unless the link says otherwise."
    )
    settle: float = Field(
        0.1, ge=0, le=10, description="Seconds between opening the line and the first request."
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


class Scale(Model):
    """The robot's own units in one range of firmware versions."""

    firmware_below: Positive | None = Field(
        None, examples=[3.0], description="Holds for firmware older than this; for all when left out."
    )
    speed_units_per_mps: Positive = Field(
        le=1e9,
        examples=[218720],
        description="Units of the speed command for one metre per second at the wheel.",
    )
    metres_per_count: Positive = Field(
        le=1, examples=[3.0678e-5], description="Way of the wheel per count of its position counter, m."
    )


class OdometryError(Model):
    """How far odometry goes astray (one standard deviation), for the covariance."""

    linear: Positive = Field(0.05, description="Metres per metre driven.")
    angular: Positive = Field(0.1, description="Radians per radian turned.")


class Kinematics(Model):
    """How the robot moves."""

    kind: Literal["differential"] = Field("differential", description="Two driven sides on one axis.")
    wheel_separation: Metres = Field(description="Distance between the wheels' tracks, m.")
    wheel_radius: Metres | None = Field(
        None,
        examples=[0.021],
        description="Radius of the wheels, m; with it the driver publishes their angles.",
    )
    wheel_speed_max: Speed = Field(description="Fastest a wheel may go, m/s at its rim.")
    wheel_speed_min: float = Field(
        0.0,
        ge=0,
        description="Slowest a wheel can go, m/s; slower orders become this or zero, whichever is nearer.",
    )
    counter_bits: int = Field(
        32, ge=8, le=64, description="Width of the position counters, after which they wrap."
    )
    scales: Annotated[tuple[Scale, ...], Field(min_length=1, strict=False)] = Field(
        (),
        examples=[[{"speed_units_per_mps": 218720, "metres_per_count": 3.0678e-5}]],
        description="The robot's own units, oldest firmware first. With several the driver asks first. "
        "A protocol of lines or bytes needs them; a rosserial sketch takes m/s and rad/s.",
    )
    odometry_error: OdometryError = Field(
        default_factory=OdometryError, description="For the covariance of `odom`."
    )

    @model_validator(mode="after")
    def _scales_in_order(self) -> Kinematics:
        bounds = [scale.firmware_below or math.inf for scale in self.scales]
        if bounds and (bounds != sorted(set(bounds)) or bounds[-1] != math.inf):
            raise MisfitError(
                "`scales` go from old firmware to new; only the last one has no `firmware_below`", "scales"
            )
        if self.wheel_speed_min >= self.wheel_speed_max:
            raise MisfitError("`wheel_speed_min` must be below `wheel_speed_max`", "wheel_speed_min")
        return self


class RobotType(Model):
    """One kind of robot."""

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
    protocol: Protocol = Field(description="What it says.")
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
    firmware_dead_man: bool = Field(description="Whether the robot stops by itself when its orders stop.")
    settings: RobotSettings = Field(
        default_factory=lambda: UNTUNED, description="What differs from swarmctl's own defaults."
    )

    @property
    def asked(self) -> Asked | None:
        """What our own driver says to it; nothing where its sketch speaks by itself."""
        return self.protocol if not isinstance(self.protocol, RosserialProtocol) else None

    @property
    def sketch(self) -> RosserialProtocol | None:
        """What runs on its board."""
        return self.protocol if isinstance(self.protocol, RosserialProtocol) else None

    def foreign(self, driver: DriverName) -> RosserialProtocol | None:
        """Its sketch, where `rosserial_python` is the robot's driver."""
        return self.sketch if driver == "rosserial_python" else None

    def query_of(self, name: str) -> Query | BinaryQuery | CodedQuery | None:
        """The query that a sensor's numbers come from."""
        return self.asked.queries.get(self.sensors[name].read or name) if self.asked else None

    @model_validator(mode="after")
    def _fits_together(self) -> RobotType:
        for misfit in misfits(self):
            raise misfit
        return self
