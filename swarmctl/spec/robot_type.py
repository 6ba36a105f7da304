"""A robot type as frozen models: how a robot is built, what its line is, what it says, and what may be tuned.

Quantities are SI and REP-103 (x forward, y left, angles counter-clockwise) unless the key names another unit.
Knows nothing of swarms: one type, one robot's settings, and the parameters that the driver reads.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from swarmctl.spec.protocols import LineProtocol, Protocol, RosserialProtocol
from swarmctl.spec.words import Model

_TEXT = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$"

Text = Annotated[str, Field(pattern=_TEXT, max_length=200)]
Positive = Annotated[float, Field(gt=0)]
Metres = Annotated[Positive, Field(examples=[0.088])]
Speed = Annotated[Positive, Field(examples=[0.3])]
Rate = Annotated[float, Field(ge=0, le=50, examples=[10.0])]


class Rates(Model):
    """How often the driver asks the robot and publishes, in Hz."""

    odom: Rate | None = Field(None, description="Odometry, Hz; 0 turns it off.")
    proximity: Rate | None = Field(None, description="Proximity sensors, Hz; 0 turns them off.")
    diagnostics: float | None = Field(
        None, ge=0.2, le=10, examples=[1.0], description="Diagnostics, Hz; cannot be turned off."
    )


class Limits(Model):
    """How fast the robot may go. The driver slows an order down as a whole, its curve unchanged."""

    linear: Speed | None = Field(
        None, description="Forward and backward speed, m/s; what the wheels bear by default."
    )
    angular: Positive | None = Field(
        None, examples=[1.5], description="Turning speed, rad/s; what the wheels bear by default."
    )


class Calibration(Model):
    """What was measured on one robot and differs from its type."""

    wheel_separation: Metres | None = Field(None, description="Distance between the wheels' tracks, m.")
    distance_scale: float | None = Field(
        None,
        ge=0.5,
        le=2,
        examples=[1.02],
        description="Distance driven by the tape measure, divided by the distance in `odom`.",
    )


class RobotSettings(Model):
    """What may be tuned for one robot. What is left out comes from the more general layer."""

    command_timeout: float | None = Field(
        None,
        ge=0.05,
        le=2,
        examples=[0.4],
        description="Seconds without an order after which the robot stops (dead-man).",
    )
    rates: Rates = Field(default_factory=Rates, description="How often the driver asks and publishes.")
    limits: Limits = Field(default_factory=Limits, description="How fast the robot may go.")
    calibration: Calibration = Field(
        default_factory=Calibration, description="What was measured on this robot."
    )


UNTUNED = RobotSettings()  # most of ten thousand robots tune nothing, and share this


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


class Scale(Model):
    """The robot's own units in one range of firmware versions."""

    firmware_below: Positive | None = Field(
        None, examples=[3.0], description="Holds for firmware older than this; for all when left out."
    )
    speed_units_per_mps: Positive = Field(
        examples=[218720],
        description="Units of the speed command for one metre per second at the wheel.",
    )
    metres_per_count: Positive = Field(
        examples=[3.0678e-5], description="Way of the wheel per count of its position counter, m."
    )


class OdometryError(Model):
    """How far odometry goes astray (one standard deviation), for the covariance."""

    linear: Positive = Field(0.05, description="Metres per metre driven.")
    angular: Positive = Field(0.1, description="Radians per radian turned.")


class Kinematics(Model):
    """How the robot moves."""

    kind: Literal["differential"] = Field("differential", description="Two driven sides on one axis.")
    wheel_separation: Metres = Field(description="Distance between the wheels' tracks, m.")
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
        "A protocol of lines needs them; a rosserial sketch takes m/s and rad/s.",
    )
    odometry_error: OdometryError = Field(
        default_factory=OdometryError, description="For the covariance of `odom`."
    )

    @model_validator(mode="after")
    def _scales_in_order(self) -> Kinematics:
        bounds = [scale.firmware_below or math.inf for scale in self.scales]
        if bounds and (bounds != sorted(set(bounds)) or bounds[-1] != math.inf):
            raise ValueError(
                "`scales` go from old firmware to new; only the last one has no `firmware_below`"
            )
        if self.wheel_speed_min >= self.wheel_speed_max:
            raise ValueError("`wheel_speed_min` must be below `wheel_speed_max`")
        return self


class Sensor(Model):
    """Where one sensor sits and where it looks."""

    name: str = Field(
        pattern=r"^[A-Za-z][A-Za-z0-9_]{0,30}$",
        examples=["front_left"],
        description="Short name, unique in its array.",
    )
    x: float = Field(examples=[0.07], description="Forward of the robot's centre, m.")
    y: float = Field(examples=[0.017], description="Left of the robot's centre, m.")
    heading_deg: float = Field(
        ge=-180,
        le=180,
        examples=[13],
        description="Where it looks, degrees, counter-clockwise from ahead.",
    )


class ProximityArray(Model):
    """Infrared proximity sensors, in the order of the robot's reply. Larger readings are nearer."""

    max_reading: int = Field(ge=1, le=65535, examples=[4095], description="Largest raw reading.")
    elements: Annotated[tuple[Sensor, ...], Field(min_length=1, strict=False)] = Field(
        description="One entry a reading."
    )


class Sensors(Model):
    proximity: ProximityArray | None = Field(None, description="Infrared proximity sensors.")


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
    sensors: Sensors = Field(default_factory=Sensors, description="What it senses.")
    firmware_dead_man: bool = Field(description="Whether the robot stops by itself when its orders stop.")
    settings: RobotSettings = Field(
        default_factory=lambda: UNTUNED, description="What differs from swarmctl's own defaults."
    )

    @property
    def line(self) -> LineProtocol | None:
        """What our own driver says to it; nothing where another driver speaks."""
        return self.protocol if self.protocol.kind == "line" else None

    @property
    def sketch(self) -> RosserialProtocol | None:
        """What runs on its board, where `rosserial_python` is its driver."""
        return self.protocol if self.protocol.kind == "rosserial" else None

    @model_validator(mode="after")
    def _fits_together(self) -> RobotType:
        match self.protocol:
            case LineProtocol() as protocol:
                self._fits_its_line(protocol)
            case RosserialProtocol():
                self._fits_its_sketch()
        return self

    def _fits_its_line(self, protocol: LineProtocol) -> None:
        proximity, query = self.sensors.proximity, protocol.read_proximity
        if (proximity is None) != (query is None):
            raise ValueError("`sensors.proximity` and `protocol.read_proximity` go together")
        if proximity is not None and query is not None and len(proximity.elements) != query.values:
            raise ValueError(
                f"`read_proximity` gives {query.values} values,"
                f" `sensors.proximity` names {len(proximity.elements)} sensors"
            )
        if not self.kinematics.scales:
            raise ValueError("lines of text carry the robot's own units; add `kinematics.scales`")
        if len(self.kinematics.scales) > 1 and protocol.identify is None:
            raise ValueError(
                "with more than one entry in `scales` the driver must ask for the firmware: add `identify`"
            )

    def _fits_its_sketch(self) -> None:
        if self.kinematics.scales:
            raise ValueError("a sketch takes orders in m/s and rad/s; remove `kinematics.scales`")
        if self.sensors.proximity is not None:
            raise ValueError("what a sketch measures stands under `protocol.publishes`; remove `sensors`")
        if self.settings.model_fields_set:
            raise ValueError("what is tuned for a rosserial robot is tuned in its sketch; remove `settings`")
        if not self.firmware_dead_man:
            raise ValueError(
                "nothing but the sketch stops a rosserial robot whose line breaks; build a dead-man into it,"
                " and write `firmware_dead_man: true`"
            )


def merged(*layers: RobotSettings) -> RobotSettings:
    """Several layers as one, from general to special: the last one that says something wins, key by key."""
    said = [layer for layer in layers if layer.model_fields_set]
    if len(said) < 2:
        return said[0] if said else UNTUNED
    data: dict[str, Any] = {}
    for layer in said:
        _lay(data, layer.model_dump(exclude_none=True))
    return RobotSettings.model_validate(data)


def _lay(under: dict[str, Any], over: Mapping[str, Any]) -> None:
    for key, value in over.items():
        if isinstance(value, Mapping):
            _lay(under.setdefault(key, {}), value)
        else:
            under[key] = value


def rates_of(robot_type: RobotType, *layers: RobotSettings) -> dict[str, float]:
    """How often a driver asks and publishes, Hz; 0 for what the robot lacks. ``layers`` as for ``merged``."""
    positions = robot_type.line is not None and robot_type.line.read_position is not None
    return {
        "odom": _last(10.0, [one.rates.odom for one in layers]) if positions else 0.0,
        "proximity": _last(5.0, [one.rates.proximity for one in layers])
        if robot_type.sensors.proximity
        else 0.0,
        "diagnostics": _last(1.0, [one.rates.diagnostics for one in layers]),
    }


def command_timeout_of(robot_type: RobotType, *layers: RobotSettings) -> float:
    """Seconds without an order after which a robot is stopped. ``layers`` as for ``merged``."""
    if robot_type.sketch is not None:
        return robot_type.sketch.firmware_timeout
    return _last(0.5, [one.command_timeout for one in layers])


def params_of(
    robot_type: RobotType,
    *,
    robot: str,
    namespace: str,
    port: str,
    settings: RobotSettings | None = None,
    baud: int | None = None,
) -> dict[str, Any]:
    """What the driver of one robot reads: its type with the robot's merged ``settings`` worked in."""
    tuned = settings or robot_type.settings
    stretch = tuned.calibration.distance_scale or 1.0
    kinematics, link = robot_type.kinematics, robot_type.link
    separation = tuned.calibration.wheel_separation or kinematics.wheel_separation
    wheel_speed = kinematics.wheel_speed_max * stretch
    proximity = robot_type.sensors.proximity
    return {
        "robot": robot,
        "title": robot_type.title,
        "namespace": namespace,
        "frame_prefix": namespace.strip("/") + "/",
        "port": port,
        "serial": {
            "baud": baud or link.baud,
            "bytesize": link.bytesize,
            "parity": link.parity,
            "stopbits": link.stopbits,
            "settle": link.settle,
            "hint": link.hint,
        },
        "command_timeout": command_timeout_of(robot_type, tuned),
        "rates": rates_of(robot_type, tuned),
        "kinematics": {
            "wheel_separation": separation,
            "wheel_speed_max": wheel_speed,
            "wheel_speed_min": kinematics.wheel_speed_min * stretch,
            "linear_max": min(tuned.limits.linear or math.inf, wheel_speed),
            "angular_max": min(tuned.limits.angular or math.inf, 2 * wheel_speed / separation),
            "counter_bits": kinematics.counter_bits,
            "odometry_error": kinematics.odometry_error.model_dump(),
            "scales": [_scaled(scale, stretch) for scale in kinematics.scales],
        },
        "protocol": _listed(robot_type.protocol.model_dump(exclude_none=True)),
        "sensors": {
            "proximity": {
                "names": [sensor.name for sensor in proximity.elements] if proximity else [],
                "max_reading": proximity.max_reading if proximity else 0,
            }
        },
    }


def _last(default: float, given: Sequence[float | None]) -> float:
    return float(next((one for one in reversed(given) if one is not None), default))


def _scaled(scale: Scale, stretch: float) -> dict[str, Any]:
    """A wheel ``stretch`` times as large as believed: fewer units for a speed, more way for a count."""
    bound = {} if scale.firmware_below is None else {"firmware_below": scale.firmware_below}
    return bound | {
        "speed_units_per_mps": scale.speed_units_per_mps / stretch,
        "metres_per_count": scale.metres_per_count * stretch,
    }


def _listed(data: Any) -> Any:
    """The same data with tuples as lists, as YAML knows them."""
    if isinstance(data, Mapping):
        return {key: _listed(value) for key, value in data.items()}
    return [_listed(value) for value in data] if isinstance(data, (list, tuple)) else data
