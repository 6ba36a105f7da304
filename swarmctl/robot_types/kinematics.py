"""How a robot moves: its kinematics, or the axes that its ROS package drives, in SI units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from swarmctl.field_types import ConsistencyError, Model, fits_together
from swarmctl.robot_types.sensors import Positive
from swarmctl.robot_types.settings import Limits, Metres, Speed, Turning
from swarmctl.units import Unit


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
    metres_per_count: Annotated[Positive, Unit("m")] = Field(
        le=1,
        examples=[3.0678e-5],
        description="Distance the wheel travels per count of its position counter.",
    )


class OdometryError(Model):
    """Error of the odometry (one standard deviation), for its covariance."""

    linear: Positive = Field(0.05, description="Metres per metre driven.")
    angular: Positive = Field(0.1, description="Radians per radian turned.")


class Kinematics(Model):
    """How the robot moves."""

    kind: Literal["differential"] = Field("differential", description="Two driven sides on one axis.")
    wheel_separation: Metres = Field(description="Distance between the wheels' tracks.")
    wheel_radius: Metres | None = Field(
        None,
        examples=[0.021],
        description="Radius of the wheels; with it the driver publishes their angles.",
    )
    wheel_speed_max: Speed = Field(description="Fastest a wheel may go, at its rim.")
    wheel_speed_min: Annotated[float, Unit("m/s")] = Field(
        0.0,
        ge=0,
        description="Slowest a wheel can go; slower commands become this or zero, whichever is nearer.",
    )
    counter_bits: int = Field(
        32, ge=8, le=64, description="Width of the position counters, after which they wrap."
    )
    scales: Annotated[tuple[Scale, ...], Field(min_length=1, strict=False)] = Field(
        (),
        examples=[[{"speed_units_per_mps": 218720, "metres_per_count": 3.0678e-5}]],
        description="The robot's own units, oldest firmware first. With several, the driver "
        "requests the firmware version first. A protocol of lines or bytes needs them; a rosserial sketch "
        "takes m/s and rad/s.",
    )
    odometry_error: OdometryError = Field(
        default_factory=OdometryError, description="For the covariance of `odom`."
    )

    @fits_together
    def _scales_in_order(self) -> Iterator[ConsistencyError]:
        bounds = [scale.firmware_below or math.inf for scale in self.scales]
        if bounds and (bounds != sorted(set(bounds)) or bounds[-1] != math.inf):
            yield ConsistencyError(
                "`scales` go from old firmware to new; only the last one has no `firmware_below`", "scales"
            )
        if self.wheel_speed_min >= self.wheel_speed_max:
            yield ConsistencyError("`wheel_speed_min` must be below `wheel_speed_max`", "wheel_speed_min")


_SIDEWAYS = ("holonomic", "legged", "aerial")


class Motion(Model):
    """The axes of a `cmd_vel` that the robot has, and the fastest on each."""

    kind: Literal["differential", "ackermann", "holonomic", "legged", "aerial", "none"] = Field(
        description="Its kinematics; `none` does not move and takes no commands."
    )
    linear_max: Speed | None = Field(None, examples=[0.22], description="Forward and backward speed.")
    lateral_max: Speed | None = Field(
        None, examples=[0.22], description="Speed sideways; as `linear_max` by default."
    )
    vertical_max: Speed | None = Field(
        None, examples=[0.5], description="Speed up and down; as `linear_max` by default."
    )
    angular_max: Turning | None = Field(None, examples=[2.84], description="Turning speed.")
    wheel_separation: Metres | None = Field(
        None, examples=[0.16], description="Distance between the wheels' tracks (differential)."
    )
    wheel_radius: Metres | None = Field(None, examples=[0.033], description="Radius of the wheels.")
    turning_radius: Annotated[Positive, Unit("m")] | None = Field(
        None, examples=[0.8], description="Smallest radius of a curve (ackermann)."
    )

    @property
    def axes(self) -> tuple[float, float, float, float]:
        """The fastest along x, y and z, m/s, and around z, rad/s; 0 for an axis that the robot lacks."""
        linear, angular = self.linear_max or 0.0, self.angular_max or 0.0
        lateral = (self.lateral_max or linear) if self.kind in _SIDEWAYS else 0.0
        vertical = (self.vertical_max or linear) if self.kind == "aerial" else 0.0
        return linear, lateral, vertical, angular

    def limited(self, limits: Limits) -> Motion:
        """Returns the motion within a robot's own limits; `linear` holds for each linear axis."""
        linear, lateral, vertical, angular = self.axes
        top = limits.linear or linear
        return self.model_copy(
            update={
                "linear_max": min(linear, top) or None,
                "lateral_max": min(lateral, top) or None,
                "vertical_max": min(vertical, top) or None,
                "angular_max": min(angular, limits.angular or angular) or None,
            }
        )

    @fits_together
    def _has_its_axes(self) -> Iterator[ConsistencyError]:
        moves = self.kind != "none"
        needed = ("linear_max", "angular_max") if moves else ()
        lacking = (
            *(() if moves else ("linear_max", "angular_max", "wheel_radius")),
            *(() if self.kind in _SIDEWAYS else ("lateral_max",)),
            *(() if self.kind == "aerial" else ("vertical_max",)),
            *(() if self.kind == "differential" else ("wheel_separation",)),
            *(() if self.kind == "ackermann" else ("turning_radius",)),
        )
        for key in needed:
            if getattr(self, key) is None:
                yield ConsistencyError(f"`{key}` of {self.kind} kinematics is missing; add it", "kind")
        for key in lacking:
            if getattr(self, key) is not None:
                yield ConsistencyError(f"{self.kind} kinematics has no `{key}`; remove it", key)


def motion_of(kinematics: Kinematics) -> Motion:
    """Returns the motion of a robot whose type has a protocol: two wheels at their fastest."""
    fastest = kinematics.wheel_speed_max
    return Motion(
        kind="differential",
        linear_max=fastest,
        angular_max=2 * fastest / kinematics.wheel_separation,
        wheel_separation=kinematics.wheel_separation,
        wheel_radius=kinematics.wheel_radius,
    )
