"""How a robot moves: the kinematics of its type, in SI units, and the scales of the robot's own units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from swarmctl.field_types import ConsistencyError, Model, fits_together
from swarmctl.robot_types.sensors import Positive
from swarmctl.robot_types.settings import Metres, Speed
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
