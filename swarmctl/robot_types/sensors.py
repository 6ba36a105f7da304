"""Sensors of a robot, cameras too: the meaning of the numbers in its replies.

Quantities are SI and REP-103 (x forward, y left, angles counter-clockwise) unless the key names another unit.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping
from itertools import islice, pairwise
from typing import Annotated, ClassVar, Literal, TypeVar

from pydantic import AfterValidator, Field, field_validator, model_validator

from swarmctl.field_types import KEY, ConsistencyError, Model, fits_together
from swarmctl.robot_types.binary_protocol import (
    BinaryExchange,
    BinaryQuery,
    binary_request,
    no_layout,
    within,
)
from swarmctl.robot_types.protocols import BinaryProtocol, DriverProtocol, QueryName
from swarmctl.text_patterns import matching
from swarmctl.units import Unit

S = TypeVar("S", bound="Reading")
Hertz = Annotated[float, Unit("Hz")]
SensorName = QueryName


class Reading(Model):
    """What all sensors have: where in which reply their numbers stand, and how often they are wanted."""

    settings_key: ClassVar[str] = ""  # of the settings that it has of its own; empty: it has none
    set_by: ClassVar[set[str]] = set()  # keys of its type that the driver does not need
    faster: ClassVar[str] = "lower the `timeout` of its query, if it replies sooner"  # advice on slow replies

    read: QueryName | None = Field(
        None,
        examples=["position"],
        description="The query whose reply has the numbers; the one of the sensor's own name if left out.",
    )
    first: int = Field(
        0, ge=0, le=255, examples=[2], description="Which number of the reply is the first, from 0."
    )
    rate: Hertz = Field(
        ge=0,
        le=50,
        examples=[5.0],
        description="How often it is read and published unless settings change it; 0 turns it off.",
    )

    @property
    def count(self) -> int:
        """How many numbers of the reply it takes."""
        return 1

    @property
    def payload(self) -> int:
        """Bytes of its message beyond those that the message's type fixes."""
        return 0

    @property
    def derived(self) -> dict[str, float]:
        """What the driver needs that follows from keys of its type."""
        return {}

    def tuned(self: S, settings: Model) -> S:
        """Returns the sensor as the ``settings`` of a robot have it under its ``settings_key``."""
        return self.model_copy(update=getattr(settings, self.settings_key).model_dump(exclude_none=True))

    def prepared(self, protocol: BinaryProtocol, query: str, *, on: bool) -> BinaryProtocol:
        """Returns the protocol with its ``query`` as set and, if it is ``on``, the request that sets it."""
        return protocol

    @classmethod
    def type_errors(
        cls, sensors: Mapping[str, Reading], protocol: DriverProtocol, settings: Model
    ) -> Iterator[ConsistencyError]:
        """Yields contradictions of a robot type that concern this kind of sensor."""
        yield from ()


Encoding = Literal["mono8", "rgb565"]
# By encoding: bytes of a pixel on the line, the encoding in which it is published, bytes of a pixel there.
_PIXEL: Mapping[Encoding, tuple[int, str, int]] = {"mono8": (1, "mono8", 1), "rgb565": (2, "rgb8", 3)}
ImageSide = Annotated[int, Field(ge=1, le=640, examples=[40])]
ChipSide = Annotated[int, Field(ge=1, le=4096)]
Zoom = Annotated[int, Field(ge=1, le=64, examples=[8])]
Coordinate = Annotated[float, Field(ge=-1, le=1), Unit("m")]
_PLACE = re.compile(r"\{(?P<name>mode|width|height|zoom):(?P<code>[bBhHiIft])\}")  # t: in decimal digits
_PIXELS = "{pixels}"


class CameraSettings(Model):
    """Size and encoding of one robot's images. What is left out comes from its type."""

    width: ImageSide | None = Field(None, description="Columns of an image.")
    height: ImageSide | None = Field(None, description="Rows of an image.")
    zoom: Zoom | None = Field(
        None, description="Pixels of the chip, across and down, that make one of the image."
    )
    encoding: Encoding | None = Field(
        None, description="`mono8`: grey; `rgb565`: colour, in twice as many bytes."
    )


NO_CAMERA_SETTINGS = CameraSettings()  # shared by all robots that set nothing


def _preparation(value: str) -> str:
    hint = "a place for mode, width, height or zoom, like {width:H}, or {width:t} for decimal digits"
    return binary_request(value, _PLACE, hint)


class Preparation(BinaryExchange):
    """The request that sets a camera, with places for how, and the reply that confirms it."""

    send: Annotated[
        str,
        Field(min_length=2, max_length=400, examples=["4a 2c {mode:t} 2c {width:t} 2c {height:t} 0d"]),
        AfterValidator(_preparation),
    ] = Field(
        description="The request: bytes in hexadecimal digits, and {mode:B}, {width:H}, {height:H} and "
        "{zoom:B} where these go; {width:t} for a number in decimal digits."
    )

    def too_small_for(self, camera: Mapping[str, int]) -> str | None:
        """Returns the name of a value that does not fit its place, or None."""
        places = (_PLACE.fullmatch(token) for token in self.send.split())
        small = (one["name"] for one in places if one and _cut(camera[one["name"]], one["code"]))
        return next(small, None)

    def filled(self, camera: Mapping[str, int], byte_order: str) -> BinaryExchange:
        """Returns the request that sets the camera so."""
        pieces = (_piece(token, camera, ">" if byte_order == "big" else "<") for token in self.send.split())
        return BinaryExchange(send=b"".join(pieces).hex(" "), reply=self.reply, begins=self.begins)


class Image(Reading):
    """A camera: the pixels of one image, row by row; one a robot at most."""

    settings_key: ClassVar[str] = "camera"
    set_by: ClassVar[set[str]] = {"modes", "chip", "largest", "prepare", "field_of_view_deg"}
    faster: ClassVar[str] = "use smaller or grey images"

    kind: Literal["image"] = Field(description="A camera.")
    rate: Hertz = Field(
        0.0, ge=0, le=50, description="How often an image is read and published; 0 is not at all."
    )
    width: ImageSide = Field(description="Columns of an image.")
    height: ImageSide = Field(description="Rows of an image.")
    zoom: Zoom = Field(
        description="Pixels of the chip, across and down, that make one of the image; the rest is cut off."
    )
    encoding: Encoding = Field(
        "mono8", description="`mono8`: a byte of grey a pixel; `rgb565`: two of colour, published as rgb8."
    )
    modes: Mapping[Encoding, Annotated[int, Field(ge=0, le=255)]] = Field(
        min_length=1,
        examples=[{"mono8": 0, "rgb565": 1}],
        description="The encodings that it has, and the robot's number for each.",
    )
    chip: Annotated[tuple[ChipSide, ChipSide], Field(strict=False)] = Field(
        examples=[[640, 480]], description="Columns and rows of the camera's chip."
    )
    largest: Annotated[int, Unit("B")] = Field(
        ge=1, le=65535, examples=[3200], description="Largest image that the robot can send."
    )
    prepare: Preparation = Field(description="The request that sets the camera, once it is to be read.")
    x: Coordinate = Field(0.0, examples=[0.03], description="Its place, forward of the robot's centre.")
    y: Coordinate = Field(0.0, description="Left of the robot's centre.")
    z: Coordinate = Field(
        0.0, examples=[0.008], description="Above the wheels' axis. It looks straight ahead."
    )
    field_of_view_deg: Annotated[float, Field(gt=0, lt=180), Unit("deg")] | None = Field(
        None,
        examples=[48],
        description="How wide the whole chip looks; without it `camera_info` has no focal length.",
    )

    @property
    def count(self) -> int:
        """Bytes of an image."""
        return self.width * self.height * _PIXEL[self.encoding][0]

    @property
    def derived(self) -> dict[str, float]:
        """The focal length, in pixels of the image; nothing if the field of view is not known."""
        if self.field_of_view_deg is None:
            return {}
        across = 2 * math.tan(math.radians(self.field_of_view_deg) / 2)
        return {"focal": round(self.chip[0] / across / self.zoom, 4)}

    @property
    def payload(self) -> int:
        """Bytes of the published pixels and of their encoding's name."""
        _, encoding, each = _PIXEL[self.encoding]
        return len(encoding) + self.width * self.height * each

    @property
    def camera_values(self) -> dict[str, int]:
        """The values that requests set and replies repeat: mode, width, height and zoom."""
        mode = self.modes.get(self.encoding, 0)
        return {"mode": mode, "width": self.width, "height": self.height, "zoom": self.zoom}

    def complaints(self) -> Iterator[tuple[str, str, str]]:
        """Why the robot cannot make such an image: the key concerned, what is wrong, what to do."""
        if self.encoding not in self.modes:
            yield "encoding", f"it has no {self.encoding}", f"write {' or '.join(self.modes)}"
        elif self.count > self.largest:
            side = math.isqrt(self.largest // _PIXEL[self.encoding][0])
            size = f"{self.width} x {self.height} in {self.encoding} are {self.count} bytes"
            yield "width", f"{size}, and it sends {self.largest} at most", f"{side} x {side} fits"
        columns, rows = self.width * self.zoom, self.height * self.zoom
        if columns > self.chip[0] or rows > self.chip[1]:
            size = f"{self.width} x {self.height} at zoom {self.zoom} are {columns} x {rows}"
            zoom = min(self.chip[0] // self.width, self.chip[1] // self.height)
            fix = f"lower `zoom` to {zoom}" if zoom else "make them smaller"
            yield "zoom", f"{size} of the chip's {self.chip[0]} x {self.chip[1]}", fix
        if small := self.prepare.too_small_for(self.camera_values):
            more = f"`prepare` cannot hold a {small} of {self.camera_values[small]}"
            yield small.replace("mode", "modes"), more, f"write a larger place, like {{{small}:H}}"

    @fits_together
    def _can_be_made(self) -> Iterator[ConsistencyError]:
        for key, what, fix in islice(self.complaints(), 1):  # a size is too large in several ways
            yield ConsistencyError(f"it cannot make such images: {what}; {fix}", key)

    def prepared(self, protocol: BinaryProtocol, query: str, *, on: bool) -> BinaryProtocol:
        """Returns the protocol with the query for such images and, if the camera is on, its setup request."""
        values, setup = self.camera_values, protocol.setup
        if on:
            setup = (*setup, self.prepare.filled(values, protocol.byte_order))
        queries = {**protocol.queries, query: protocol.queries[query].filled(values, self.count)}
        return protocol.model_copy(update={"queries": queries, "setup": setup})

    @classmethod
    def type_errors(
        cls, sensors: Mapping[str, Reading], protocol: DriverProtocol, settings: Model
    ) -> Iterator[ConsistencyError]:
        """Yields what is wrong with a camera, with the replies that have pixels, and with its settings."""
        cameras = {name: one for name, one in sensors.items() if isinstance(one, cls)}
        queries = protocol.queries if isinstance(protocol, BinaryProtocol) else {}
        read = {one.read or name for name, one in cameras.items()}
        for name, query in queries.items():
            at = ("protocol", "queries", name)
            if wrong := _reply_error(query):
                yield ConsistencyError(wrong, *at, "reply")
            elif name in read and not _has_pixels(query):
                wrong = f"the reply to `{name}` is not an image; write `{_PIXELS}` at its end"
                yield ConsistencyError(wrong, *at, "reply")
            elif name not in read and _has_pixels(query):
                wrong = f"no sensor of kind `image` reads `{name}`, whose reply has pixels; name it under "
                yield ConsistencyError(f"{wrong}`read` of one", *at, KEY)
        for name in list(cameras)[1:]:
            yield ConsistencyError("a robot has one camera; take the others out", "sensors", name, KEY)
        if not cameras and getattr(settings, cls.settings_key) != NO_CAMERA_SETTINGS:
            yield ConsistencyError("none of the `sensors` is of kind `image`", "settings", "camera", KEY)
        for name, image in cameras.items():
            of_image = queries.get(image.read or name)
            first = image.first if of_image is None else of_image.values
            if not isinstance(protocol, BinaryProtocol):
                wrong = "only a protocol of kind `binary` brings images; take it out"
                yield ConsistencyError(wrong, "sensors", name, "kind")
            elif image.first != first:
                wrong = f"the pixels come after {first} numbers; write `first: {first}`"
                yield ConsistencyError(wrong, "sensors", name, "first")
            for _, what, fix in image.tuned(settings).complaints():
                wrong = f"it cannot make such images: {what}; {fix}"
                yield ConsistencyError(wrong, "settings", "camera", KEY)


def _has_pixels(query: BinaryQuery) -> bool:
    return query.places[-1:] == (_PIXELS,)


def _reply_error(query: BinaryQuery) -> str:
    """Returns what is wrong with the places of a reply, or an empty text."""
    tokens = query.reply.split()
    repeated = [one for one in query.places if one != _PIXELS]
    if _PIXELS in tokens[:-1]:
        return f"the pixels come last; move `{_PIXELS}` to the end"
    for one in repeated:
        if not _PLACE.fullmatch(one):
            return no_layout(one)
    if repeated and not _has_pixels(query):
        return f"a reply that repeats how a camera is set ends with its `{_PIXELS}`"
    if repeated and (query.begins or tokens[0] != repeated[0]):
        return f"put {' '.join(repeated)} first in the reply, and leave `begins` out"
    return ""


def _cut(number: int, code: str) -> bool:
    """True if a number does not fit its place; in decimal digits any fits."""
    return code != "t" and within(number, code) != number


def _piece(token: str, camera: Mapping[str, int], order: str) -> bytes:
    """One token of a request in bytes."""
    place = _PLACE.fullmatch(token)
    if place is None:
        return bytes.fromhex(token)
    number, code = camera[place["name"]], place["code"]
    return str(number).encode() if code == "t" else struct.pack(order + code, within(number, code))


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
