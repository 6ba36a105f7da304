"""A robot type as frozen models: how a robot is built, what its line is, what it says, senses and shows.

Quantities are SI and REP-103 (x forward, y left, angles counter-clockwise) unless the key names another unit.
Knows nothing of swarms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, model_validator

from swarmctl.spec.firmware import clashes
from swarmctl.spec.protocols import Asked, DriverName, Protocol, RosserialProtocol
from swarmctl.spec.queries import SIDES, BinaryQuery, CodedQuery, Query, room_of
from swarmctl.spec.sensors import FRAME_TOPICS, Actuator, Positive, Sensor, SensorName
from swarmctl.spec.settings import (
    COMMAND_TIMEOUT,
    DIAGNOSTICS,
    DIAGNOSTICS_RATE,
    UNTUNED,
    Metres,
    RobotSettings,
    Speed,
    last_rate,
)
from swarmctl.spec.words import Model

ODOM = "odom"
SHORTEST_WATCHDOG = 1.0  # s
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
            raise ValueError(
                "`scales` go from old firmware to new; only the last one has no `firmware_below`"
            )
        if self.wheel_speed_min >= self.wheel_speed_max:
            raise ValueError("`wheel_speed_min` must be below `wheel_speed_max`")
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
        if self.asked is None:
            self._fits_its_sketch()
        else:
            self._fits_its_line(self.asked)
        unknown = next((one for one in self.settings.rates if one not in {*self.sensors, DIAGNOSTICS}), None)
        if unknown is not None:
            raise ValueError(f"`settings` have a rate for `{unknown}`, which is none of the `sensors`")
        return self

    def _fits_its_line(self, protocol: Asked) -> None:
        for complaint in (
            *self._ill_named(), *self._misread(protocol), *self._misset(protocol), *self._too_fast(protocol),
        ):  # fmt: skip
            raise ValueError(complaint)
        if not self.kinematics.scales:
            raise ValueError("wheels count in the robot's own units; add `kinematics.scales`")
        if len(self.kinematics.scales) > 1 and not getattr(protocol, "identify", None):
            raise ValueError(
                "with more than one entry in `scales` the driver must ask for the firmware: add `identify`"
            )

    def _ill_named(self) -> Iterator[str]:
        for name in (*self.sensors, *self.actuators):
            if name in (*FRAME_TOPICS, DIAGNOSTICS) or (name in self.sensors and name in self.actuators):
                yield f"the name `{name}` is taken; give the topic another one"
        for name, sensor in self.sensors.items():
            if (sensor.kind == "wheels") != (name == ODOM):
                yield f"position counters, and nothing else, are called `{ODOM}`; rename `{name}`"

    def _misread(self, protocol: Asked) -> Iterator[str]:
        for name, sensor in self.sensors.items():
            query = protocol.queries.get(sensor.read or name)
            if query is None:
                yield (
                    f"sensor `{name}` reads `{sensor.read or name}`, which is none of the `queries`; "
                    f"add it there, or name one of {', '.join(protocol.queries) or 'none yet'} under `read`"
                )
            elif sensor.first + sensor.count > query.values:
                yield (
                    f"the reply to `{sensor.read or name}` has {query.values} values, sensor `{name}` takes "
                    f"{sensor.count} from number {sensor.first} on; mend `first`, or what the reply has"
                )
        used = {sensor.read or name for name, sensor in self.sensors.items()}
        for idle in [name for name in protocol.queries if name not in used]:
            yield f"no sensor reads the query `{idle}`; add one to `sensors`, or take the query out"

    def _misset(self, protocol: Asked) -> Iterator[str]:
        for name, actuator in self.actuators.items():
            if protocol.kind == "python":
                if actuator.send is not None:
                    yield f"the class of the protocol writes the requests; remove `send` of actuator `{name}`"
            elif actuator.send is None:
                yield f"`send` of actuator `{name}` is missing; write the request for one channel"
            elif actuator.binary != (protocol.kind == "binary"):
                yield f"`send` of actuator `{name}` is not written for a protocol of kind `{protocol.kind}`"

    def _too_fast(self, protocol: Asked) -> Iterator[str]:
        if protocol.kind != "binary" or not self.kinematics.scales:
            return
        lowest, highest = room_of(protocol.set_speed.send, *SIDES)
        units = self.kinematics.wheel_speed_max * max(
            one.speed_units_per_mps for one in self.kinematics.scales
        )
        if round(units) > min(-lowest, highest):
            yield (
                f"`wheel_speed_max` is {units:g} units of speed, and `set_speed` has room for {lowest:g} to "
                f"{highest:g}; write larger places, like {{left:i}}, or mend `scales`"
            )

    def _fits_our_sketch(self) -> None:
        if self.kinematics.wheel_radius is None:
            raise ValueError("a sketch divides by the wheels' radius; add `kinematics.wheel_radius`")
        for second, first, pin in clashes(self.settings.firmware):
            raise ValueError(f"pin {pin} has two uses, `{'.'.join(first)}` and `{'.'.join(second)}`")

    def _fits_its_sketch(self) -> None:
        if self.kinematics.scales:
            raise ValueError("a sketch takes orders in m/s and rad/s; remove `kinematics.scales`")
        if self.sensors or self.actuators:
            raise ValueError(
                "what a sketch measures and hears stands under `protocol`; remove `sensors` and `actuators`"
            )
        if self.sketch and self.sketch.firmware:
            self._fits_our_sketch()
        if self.sketch and self.sketch.odometry and self.kinematics.wheel_radius is None:
            raise ValueError(
                "`odometry` needs to know how large the wheels are: add `kinematics.wheel_radius`"
            )
        if not self.firmware_dead_man:
            raise ValueError(
                "nothing but the sketch stops a rosserial robot whose line breaks; build a dead-man into it,"
                " and write `firmware_dead_man: true`"
            )


def rates_of(robot_type: RobotType, *layers: RobotSettings) -> dict[str, float]:
    """How often a driver reads and publishes each sensor, Hz; 0 is off. ``layers`` as for ``merged``."""
    rates = {name: last_rate(one.rate, name, layers) for name, one in robot_type.sensors.items()}
    return {**rates, DIAGNOSTICS: last_rate(DIAGNOSTICS_RATE, DIAGNOSTICS, layers)}


def command_timeout_of(robot_type: RobotType, *layers: RobotSettings) -> float:
    """Seconds without an order after which a robot is stopped. ``layers`` as for ``merged``."""
    said = (one.command_timeout for one in reversed(layers) if one.command_timeout is not None)
    return float(next(said, COMMAND_TIMEOUT))


def watchdog_of(robot_type: RobotType) -> float:
    """Seconds without a sign of life after which a driver hangs; it gives one every two exchanges."""
    asked = robot_type.asked
    return max(SHORTEST_WATCHDOG, 4 * asked.reply_timeout if asked else 0.0)
