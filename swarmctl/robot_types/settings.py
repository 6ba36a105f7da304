"""What may be tuned for one robot, and how several layers of it make one."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from swarmctl.field_types import ConsistencyError, Model, fits_together
from swarmctl.robot_types.sensors import NO_CAMERA_SETTINGS, CameraSettings, Positive, SensorName
from swarmctl.robot_types.sketch_settings import NO_FIRMWARE_SETTINGS, Firmware
from swarmctl.units import Unit

DIAGNOSTICS = "diagnostics"
DIAGNOSTICS_RATE = 1.0  # Hz
COMMAND_TIMEOUT = 0.5  # s

Metres = Annotated[float, Field(ge=0.001, le=100, examples=[0.088]), Unit("m")]
Speed = Annotated[Positive, Field(le=100, examples=[0.3]), Unit("m/s")]
Rate = Annotated[float, Field(ge=0, le=50, examples=[10.0]), Unit("Hz")]
Turning = Annotated[Positive, Unit("rad/s")]
VelocityType = Literal["geometry_msgs/Twist", "geometry_msgs/TwistStamped"]


class Limits(Model):
    """How fast the robot may go. The driver scales a command down as a whole, its curve unchanged."""

    linear: Speed | None = Field(
        None, description="Forward and backward speed; what the wheels bear by default."
    )
    angular: Turning | None = Field(
        None, examples=[1.5], description="Turning speed; what the wheels bear by default."
    )


class Calibration(Model):
    """What was measured on one robot and differs from its type."""

    wheel_separation: Metres | None = Field(None, description="Distance between the wheels' tracks.")
    distance_scale: float | None = Field(
        None,
        ge=0.5,
        le=2,
        examples=[1.02],
        description="Distance driven by the tape measure, divided by the distance in `odom`.",
    )


class BatteryLimits(Model):
    """When the robot's battery is low, and when it is empty: shares of a full one, by their readings."""

    low: float = Field(
        gt=0, lt=1, examples=[0.25], description="Below it `status` warns, and no trial of `run` begins."
    )
    empty: float = Field(
        gt=0,
        lt=1,
        examples=[0.1],
        description="Below it the robot stands, and takes no command until its battery is no longer `low`.",
    )

    @fits_together
    def _empty_below_low(self) -> Iterator[ConsistencyError]:
        if self.empty >= self.low:
            yield ConsistencyError("`empty` must be below `low`", "empty")


class CommandSettings(Model):
    """What may be tuned of the commands of any robot, whichever its driver."""

    command_timeout: Annotated[float, Field(ge=0.05, le=2, examples=[0.4]), Unit("s")] | None = Field(
        None,
        description="Time without a command after which the robot stops (dead-man).",
    )
    command_type: VelocityType | None = Field(
        None,
        examples=["geometry_msgs/TwistStamped"],
        description="Message type of its commands, as its commanders publish them: by default what the "
        "programs declare that publish its command topic, geometry_msgs/Twist if none does or they differ.",
    )
    limits: Limits = Field(default_factory=Limits, description="How fast the robot may go.")
    battery: BatteryLimits | None = Field(
        None,
        examples=[{"low": 0.25, "empty": 0.1}],
        description="When its battery is low and when empty, where swarmctl's driver or the gate reads it.",
    )


class RobotSettings(CommandSettings):
    """What may be tuned for one robot. What is left out comes from the more general layer."""

    rates: dict[SensorName, Rate] = Field(
        default_factory=dict,
        examples=[{"odom": 20.0, "proximity": 10.0}],
        description="How often the driver reads and publishes each sensor; 0 turns it off. "
        "`diagnostics` is one of them and cannot be turned off: 0.2 to 10 Hz.",
    )
    calibration: Calibration = Field(
        default_factory=Calibration, description="What was measured on this robot."
    )
    camera: CameraSettings = Field(
        default_factory=lambda: NO_CAMERA_SETTINGS,
        description="The images of its camera, where it has one; `rates` sets how often they come.",
    )
    firmware: Firmware = Field(
        default_factory=lambda: NO_FIRMWARE_SETTINGS,
        description="The sketch of its board, where swarmctl writes that (`protocol.firmware` of its type).",
    )

    @property
    def of_sensors(self) -> Hashable:
        """Everything that concerns sensors: robots of one type in which this is equal are read alike."""
        return (self.camera, *sorted(self.rates.items()))

    @field_validator("rates")
    @classmethod
    def _diagnostics_stay_on(cls, rates: dict[str, float]) -> dict[str, float]:
        if not 0.2 <= rates.get(DIAGNOSTICS, DIAGNOSTICS_RATE) <= 10:
            raise ConsistencyError(
                "`diagnostics` come at 0.2 to 10 Hz; they cannot be turned off", DIAGNOSTICS
            )
        return rates


NO_SETTINGS = RobotSettings()  # shared by all robots that set nothing


def merged(*layers: RobotSettings) -> RobotSettings:
    """Merges layers, from general to special: key by key the last one that sets a value wins."""
    declared = [layer for layer in layers if layer.model_fields_set]
    if len(declared) < 2:
        return declared[0] if declared else NO_SETTINGS
    data: dict[str, Any] = {}
    for layer in declared:
        _lay(data, layer.model_dump(exclude_none=True))
    return RobotSettings.model_validate(data)


def _lay(under: dict[str, Any], over: Mapping[str, Any]) -> None:
    for key, value in over.items():
        if isinstance(value, Mapping):
            _lay(under.setdefault(key, {}), value)
        else:
            under[key] = value


def last_rate(default: float, name: str, layers: Sequence[RobotSettings]) -> float:
    """Returns the rate of one sensor, Hz: the most special layer that names it."""
    return float(next((one.rates[name] for one in reversed(layers) if name in one.rates), default))
