"""The camera of a robot: its settings, and the requests and replies of its protocol that follow from them."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from swarmctl.field_types import KEY, ConsistencyError, Model, fits_together
from swarmctl.robot_types.binary_protocol import (
    BinaryExchange,
    BinaryQuery,
    binary_request,
    no_layout,
    within,
)
from swarmctl.robot_types.protocols import BinaryProtocol, DriverProtocol
from swarmctl.robot_types.reading import Hertz, Reading
from swarmctl.units import Unit

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
