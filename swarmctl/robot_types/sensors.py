"""Sensors of a robot: the meaning of the numbers in its replies.

Quantities are SI and REP-103 (x forward, y left, angles counter-clockwise) unless the key names another unit.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, field_validator, model_validator

from swarmctl.field_types import ConsistencyError, Model, fits_together
from swarmctl.robot_types.cameras import Image
from swarmctl.robot_types.reading import Hertz, Reading
from swarmctl.text_patterns import matching
from swarmctl.units import Unit

ElementName = Annotated[str, matching(
    r"^[A-Za-z][A-Za-z0-9_]{0,30}$", "letters, digits and _, a letter first, 31 at most",
    examples=["front_left"],
)]  # fmt: skip
Positive = Annotated[float, Field(gt=0)]
UnitName = Annotated[str, matching(
    r"^[A-Za-z/%0-9^*-]{1,16}$", "a unit such as `m/s` or `deg` (letters, digits, / % ^ * -), 16 at most",
    examples=["A"],
)]  # fmt: skip
Metre = Annotated[float, Unit("m")]
Degrees = Annotated[float, Unit("deg")]
Volts = Annotated[float, Unit("V")]
Three = Annotated[tuple[float, float, float], Field(strict=False)]
ODOM = "odom"
SCAN = "scan"  # of an array of distance sensors, beside the topics of its elements
FRAME_TOPICS = ("cmd_vel", "joint_states")  # of every driver; no sensor or actuator is called so


def distinct(names: tuple[str, ...]) -> tuple[str, ...]:
    """Returns ``names`` if no name occurs twice. Raises ``ValueError``."""
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two of them are called `{name}`; give each its own name")
    return names


Names = Annotated[tuple[ElementName, ...], Field(min_length=1, strict=False), AfterValidator(distinct)]


class Place(Model):
    """Where one sensor sits and where it looks."""

    name: ElementName = Field(description="Short name, unique in its array.")
    x: Metre = Field(examples=[0.07], description="Forward of the robot's centre.")
    y: Metre = Field(examples=[0.017], description="Left of the robot's centre.")
    z: Metre = Field(0.0, examples=[0.034], description="Above the wheels' axis.")
    heading_deg: Degrees = Field(
        ge=-180,
        le=180,
        examples=[13],
        description="Where it looks, counter-clockwise from ahead.",
    )


class Wheels(Reading):
    """Both position counters, left first: `odom`, the transform to it, and the joints of both wheels."""

    kind: Literal["wheels"] = Field(description="Position counters of both wheels.")
    rate: Hertz = Field(10.0, ge=0, le=50, description="How often they are read and published.")

    @property
    def count(self) -> int:
        """How many numbers of the reply it needs."""
        return 2


class Range(Reading):
    """Distance sensors. Each has a topic in metres, all have a scan; the raw readings are one message."""

    kind: Literal["range"] = Field(description="Distance sensors, infrared or ultrasound.")
    radiation: Literal["infrared", "ultrasound"] = Field("infrared", description="What they send out.")
    max_reading: int = Field(ge=1, le=65535, examples=[4095], description="Largest raw reading.")
    distances: Annotated[tuple[tuple[float, Annotated[Metre, Field(ge=0)]], ...], Field(strict=False)] = (
        Field(
            min_length=2,
            examples=[[[100, 0.05], [4095, 0.005]]],
            description="Raw readings and the distances that they stand for, m, by rising reading; between "
            "them the driver interpolates. The nearest and the farthest are the sensor's limits.",
        )
    )
    none_from: int | None = Field(
        None, ge=0, examples=[1000], description="Readings from this value on mean that nothing is in range."
    )
    none_below: int | None = Field(
        None, ge=1, examples=[1], description="Readings below this value mean that nothing is in range."
    )
    invalid_from: int | None = Field(
        None,
        ge=1,
        examples=[2000],
        description="A reading from here on is none: the sensor is off.",
    )
    field_of_view_deg: Degrees = Field(gt=0, le=360, examples=[15], description="How wide each one looks.")
    stride: int = Field(
        1, ge=1, le=16, description="From one sensor's number to the next one's in the reply."
    )
    elements: Annotated[tuple[Place, ...], Field(min_length=1, strict=False)] = Field(
        description="One entry a sensor, in the order of the reply."
    )

    @property
    def count(self) -> int:
        """How many numbers of the reply it needs."""
        return (len(self.elements) - 1) * self.stride + 1

    @field_validator("distances", mode="before")
    @classmethod
    def _pairs(cls, value: object) -> object:
        """Lists of YAML as the pairs that the strict model wants."""
        if isinstance(value, (list, tuple)):
            return tuple(tuple(one) if isinstance(one, (list, tuple)) else one for one in value)
        return value

    @fits_together
    def _holds_together(self) -> Iterator[ConsistencyError]:
        if any(after[0] <= before[0] for before, after in pairwise(self.distances)):
            yield ConsistencyError(
                "`distances` go from small readings to large ones; put them in order", "distances"
            )
        names = [one.name for one in self.elements]
        if len(set(names)) < len(names):
            yield ConsistencyError("two of the `elements` have the same name; give each its own", "elements")
        if SCAN in names:
            yield ConsistencyError(
                f"`{SCAN}` is the topic of all of them together; choose another name", "elements"
            )


class Raw(Reading):
    """Plain numbers of the robot's: ambient light, ground sensors, microphones, a selector."""

    kind: Literal["raw"] = Field(description="Whole numbers as the robot gives them.")
    names: Names = Field(
        examples=[["left", "right"]], description="One name a number, in the order of the reply."
    )

    @property
    def count(self) -> int:
        """How many numbers of the reply it needs."""
        return len(self.names)


class Quantity(Reading):
    """Numbers with a unit: currents, voltages, counts per second."""

    kind: Literal["quantity"] = Field(description="Numbers with a unit.")
    names: Names = Field(
        examples=[["left", "right"]], description="One name a number, in the order of the reply."
    )
    unit: UnitName = Field(description="Its unit once scaled, SI.")
    scale: float = Field(1.0, examples=[0.004], description="The unit for each unit of the robot's.")
    offset: float = Field(0.0, description="Added after scaling, in the unit.")

    @property
    def count(self) -> int:
        """How many numbers of the reply it needs."""
        return len(self.names)


class Axes(Model):
    """Three numbers along the axes of the robot (x forward, y left, z up)."""

    first: int = Field(
        0, ge=0, le=255, examples=[3], description="Counted from the sensor's own first number."
    )
    order: Annotated[tuple[int, int, int], Field(strict=False)] = Field(
        (0, 1, 2), examples=[[1, 0, 2]], description="Which of the three numbers is x, y and z."
    )
    zero: Three = Field(
        (0.0, 0.0, 0.0),
        examples=[[2048.0, 2048.0, 2048.0]],
        description="What x, y and z read when there is nothing to measure.",
    )
    scale: Three = Field(
        examples=[[5.99e-4, 5.99e-4, 5.99e-4]],
        description="SI (m/s2, rad/s, T) for each unit of x, y and z; negative where it counts backwards.",
    )

    @fits_together
    def _a_permutation(self) -> Iterator[ConsistencyError]:
        if sorted(self.order) != [0, 1, 2]:
            yield ConsistencyError("`order` names each of 0, 1 and 2 once", "order")


class Inertial(Reading):
    """An accelerometer, a gyroscope, or both, in one sensor_msgs/Imu message."""

    kind: Literal["imu"] = Field(description="Acceleration (m/s2), rotation (rad/s), or both.")
    acceleration: Axes | None = Field(None, description="The accelerometer.")
    rotation: Axes | None = Field(None, description="The gyroscope.")

    @property
    def count(self) -> int:
        """How many numbers of the reply it needs."""
        return max((one.first + 3 for one in (self.acceleration, self.rotation) if one), default=0)

    @model_validator(mode="after")
    def _one_of_both(self) -> Inertial:
        if self.acceleration is None and self.rotation is None:
            raise ValueError("an `imu` measures something; add `acceleration` or `rotation`")
        return self


class Magnetic(Reading):
    """A magnetometer."""

    kind: Literal["magnetic"] = Field(description="The magnetic field, T.")
    axes: Axes = Field(description="Its three numbers.")

    @property
    def count(self) -> int:
        """How many numbers of the reply it needs."""
        return self.axes.first + 3


class Battery(Reading):
    """The battery's voltage, and how full that is."""

    kind: Literal["battery"] = Field(description="The battery.")
    volts: Annotated[tuple[Volts, ...], Field(min_length=1, max_length=4, strict=False)] = Field(
        examples=[[0.02]],
        description="Voltage for each unit of each number of the reply; what they make is added up.",
    )
    offset: Volts = Field(0.0, description="Added to that.")
    empty: Annotated[Positive, Unit("V")] = Field(examples=[3.4], description="Voltage at which it is empty.")
    full: Annotated[Positive, Unit("V")] = Field(examples=[4.2], description="Voltage at which it is full.")

    @property
    def count(self) -> int:
        """How many numbers of the reply it needs."""
        return len(self.volts)

    @fits_together
    def _fuller_than_empty(self) -> Iterator[ConsistencyError]:
        if self.empty >= self.full:
            yield ConsistencyError("`empty` must be below `full`", "empty")


class Temperature(Reading):
    """A thermometer."""

    kind: Literal["temperature"] = Field(description="A temperature, degrees Celsius.")
    scale: float = Field(1.0, examples=[0.1], description="Degrees for each unit of the robot's.")
    offset: float = Field(0.0, description="Degrees added after scaling.")


Sensor = Annotated[
    Wheels | Range | Raw | Quantity | Inertial | Magnetic | Battery | Temperature | Image,
    Field(discriminator="kind"),
]
SENSORS: dict[str, type[Reading]] = {
    "wheels": Wheels, "range": Range, "raw": Raw, "quantity": Quantity, "imu": Inertial, "magnetic": Magnetic,
    "battery": Battery, "temperature": Temperature, "image": Image,
}  # fmt: skip
