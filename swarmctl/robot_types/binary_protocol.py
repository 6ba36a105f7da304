"""Requests and replies in bytes: tokens that are a byte in hexadecimal digits or a place for a value."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Mapping
from itertools import takewhile
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from swarmctl.field_types import ConsistencyError, Model
from swarmctl.robot_types.line_protocol import SIDES, Timeout

_BYTE = re.compile(r"[0-9a-fA-F]{2}")
_PLACE = re.compile(r"\{(?P<name>[a-z]+):(?P<code>[bBhHiIf])\}")
_LAYOUT = re.compile(r"(?P<count>[1-9][0-9]{0,3})?(?P<code>[bBhHiIf])")
_OF_CAMERA = re.compile(r"\{(?P<name>mode|width|height|zoom):(?P<code>[bBhHiIft])\}")  # t: in decimal digits
_PIXELS = "{pixels}"


def binary_request(value: str) -> str:
    for token in value.split():
        if not (_BYTE.fullmatch(token) or _PLACE.fullmatch(token)):
            raise ValueError(
                f"`{token}` is neither a byte in two hexadecimal digits nor a place like {{left:h}}"
            )
    return value


def _preparation(value: str) -> str:
    for token in value.split():
        if not (_BYTE.fullmatch(token) or _OF_CAMERA.fullmatch(token)):
            raise ValueError(
                f"`{token}` is neither a byte in two hexadecimal digits nor a place for mode, width, height "
                "or zoom, like {width:H}, or {width:t} for decimal digits"
            )
    return value


def layout(value: str) -> str:
    for token in value.split():
        if not _LAYOUT.fullmatch(token):
            raise ValueError(f"`{token}` is no layout; write a count and one of b B h H i I f, like 8H")
    return value


def _answer(value: str) -> str:
    """Checks a layout that may repeat the camera's settings and end with the pixels."""
    tokens = value.split()
    if _PIXELS in tokens[:-1]:
        raise ValueError(f"the pixels come last; move `{_PIXELS}` to the end")
    layout(" ".join(one for one in tokens if one != _PIXELS and not _is_camera_value(one)))
    return value


def _is_camera_value(token: str) -> bool:
    """True for a token of a reply that repeats a camera setting."""
    place = _OF_CAMERA.fullmatch(token)
    return place is not None and place["code"] != "t"


Bytes = Annotated[
    str, Field(min_length=2, max_length=400, examples=["af 00"]), AfterValidator(binary_request)
]
Layout = Annotated[str, Field(max_length=80, examples=["2h"]), AfterValidator(layout)]
Answer = Annotated[str, Field(max_length=80, examples=["2h"]), AfterValidator(_answer)]
CameraBytes = Annotated[
    str,
    Field(min_length=2, max_length=400, examples=["4a 2c {mode:t} 2c {width:t} 2c {height:t} 0d"]),
    AfterValidator(_preparation),
]


class BinaryExchange(Model):
    """One request and its reply as bytes: a request in hexadecimal digits, a reply of known layout."""

    send: Bytes = Field(description="The request: bytes in hexadecimal digits, each by itself.")
    reply: Layout = Field(
        "",
        description="What comes back, value by value: b B h H i I f as Python's `struct` has them, a "
        "count before them where they repeat. Empty for a robot that does not answer.",
    )
    begins: Annotated[tuple[int, ...], Field(max_length=8, strict=False)] = Field(
        (),
        examples=[[85, 170]],
        description="Whole numbers that the reply always begins with; another reply is an error.",
    )

    @property
    def codes(self) -> str:
        """One letter a number of the reply, as `struct` has them; pixels are not among them."""
        tokens = [_LAYOUT.fullmatch(one) or _OF_CAMERA.fullmatch(one) for one in self.reply.split()]
        return "".join(one["code"] * int(one.groupdict().get("count") or 1) for one in tokens if one)

    @property
    def values(self) -> int:
        """How many numbers the reply has."""
        return len(self.codes)

    @model_validator(mode="after")
    def _places(self) -> BinaryExchange:
        """Rejects places: nothing fills them here."""
        place = _PLACE.search(self.send)
        if place is not None:
            raise ConsistencyError(
                f"nothing fills `{place.group()}` here; write the bytes themselves", "send"
            )
        return self

    @model_validator(mode="after")
    def _check_begins(self) -> BinaryExchange:
        if len(self.begins) > self.values:
            raise ConsistencyError(
                f"`begins` has {len(self.begins)} numbers, the reply {self.values}", "begins"
            )
        for number, code in zip(self.begins, self.codes, strict=False):
            low, high = _bounds(code)
            if not low <= number <= high:
                raise ConsistencyError(
                    f"no reply begins with {number} where `reply` has {code}; correct `begins`", "begins"
                )
        return self

    def length(self, _: int) -> tuple[int, int]:
        """Bytes of the request and of its reply."""
        sizes = (_PLACE.fullmatch(token) for token in self.send.split())
        request = sum(struct.calcsize("<" + one["code"]) if one else 1 for one in sizes)
        return request, struct.calcsize("<" + self.codes)


class BinaryQuery(BinaryExchange):
    """A query in bytes, and the layout of its reply."""

    reply: Answer = Field(
        "",
        description="What comes back, value by value: b B h H i I f as Python's `struct` has them, a "
        "count before them where they repeat. That of a camera ends with {pixels}, and has {mode:B}, "
        "{width:B} and the like where it repeats how the camera is set.",
    )
    timeout: Timeout | None = None

    @property
    def pixels(self) -> bool:
        """Whether the reply is an image."""
        return self.reply.split()[-1:] == [_PIXELS]

    @model_validator(mode="after")
    def _check_camera_reply(self) -> BinaryQuery:
        repeated = [one for one in self.reply.split() if _is_camera_value(one)]
        if repeated and not self.pixels:
            raise ConsistencyError(
                f"a reply that repeats how a camera is set ends with its `{_PIXELS}`", "reply"
            )
        if repeated and (self.begins or not _is_camera_value(self.reply.split()[0])):
            raise ConsistencyError(
                f"put {' '.join(repeated)} first in the reply, and leave `begins` out",
                "reply",
            )
        return self

    def of_camera(self, camera: Mapping[str, int], pixels: int) -> BinaryQuery:
        """The query for an image of ``pixels`` bytes, whose reply begins with the values of ``camera``.

        A number that does not fit its place is cut to its lowest bytes.
        """
        places = takewhile(bool, map(_OF_CAMERA.fullmatch, self.reply.split()))
        repeated = tuple(_within(camera[one["name"]], one["code"]) for one in places if one)
        reply = f"{' '.join(self.codes)} {pixels}B".strip()
        return self.model_copy(update={"reply": reply, "begins": repeated or self.begins})


class Preparation(BinaryExchange):
    """The request that sets a camera, with places for how, and the reply that confirms it."""

    send: CameraBytes = Field(
        description="The request: bytes in hexadecimal digits, and {mode:B}, {width:H}, {height:H} and "
        "{zoom:B} where these go; {width:t} for a number in decimal digits."
    )

    @model_validator(mode="after")
    def _places(self) -> Preparation:
        """Accepts the places of a camera, which its settings fill."""
        return self

    def too_small_for(self, camera: Mapping[str, int]) -> str | None:
        """Returns the name of a value that does not fit its place, or None."""
        places = (_OF_CAMERA.fullmatch(token) for token in self.send.split())
        small = (one["name"] for one in places if one and _cut(camera[one["name"]], one["code"]))
        return next(small, None)

    def filled(self, camera: Mapping[str, int], byte_order: str) -> BinaryExchange:
        """The request that sets the camera so."""
        pieces = (_piece(token, camera, ">" if byte_order == "big" else "<") for token in self.send.split())
        return BinaryExchange(send=b"".join(pieces).hex(" "), reply=self.reply, begins=self.begins)


class BinarySpeedCommand(BinaryExchange):
    """The request that sets both wheel speeds, with {left:h} and {right:h} where the units go."""

    send: Bytes = Field(
        examples=["bc {left:h} {right:h} bb 00"],
        description="The request, with a place and its layout where the units of each side go.",
    )
    echo: bool = Field(
        False,
        description="Whether the reply repeats both speeds of the command; another reply is then an error.",
    )

    @model_validator(mode="after")
    def _places(self) -> BinarySpeedCommand:
        if sorted(one["name"] for one in _PLACE.finditer(self.send)) != sorted(SIDES):
            raise ConsistencyError("`send` of `set_speed` needs {left:h} and {right:h}, once each", "send")
        if self.echo and (self.values != len(SIDES) or self.begins):
            raise ConsistencyError(
                "an echo has two values; correct `reply`, or leave `echo` or `begins` out", "reply"
            )
        return self


def is_binary(send: str) -> bool:
    """Whether the places of a request have a layout, as those of bytes do."""
    return _PLACE.search(send) is not None


def value_range(send: str, *names: str) -> tuple[float, float]:
    """Returns the smallest and largest number that all places with these names in a request hold."""
    bounds = [_bounds(one["code"]) for one in _PLACE.finditer(send) if one["name"] in names]
    return max(low for low, _ in bounds), min(high for _, high in bounds)


def _piece(token: str, camera: Mapping[str, int], order: str) -> bytes:
    """One token of a request in bytes."""
    place = _OF_CAMERA.fullmatch(token)
    if place is None:
        return bytes.fromhex(token)
    number, code = camera[place["name"]], place["code"]
    return str(number).encode() if code == "t" else struct.pack(order + code, _within(number, code))


def _cut(number: int, code: str) -> bool:
    """True if a number does not fit its place; in decimal digits any fits."""
    return code != "t" and _within(number, code) != number


def _within(number: int, code: str) -> int:
    """What is left of a number in a place: its lowest bytes."""
    if code == "f":
        return number
    low, high = _bounds(code)
    return int((number - low) % (high - low + 1) + low)


def _bounds(code: str) -> tuple[float, float]:
    if code == "f":
        return -math.inf, math.inf
    bits = 8 * struct.calcsize("<" + code)
    return (0, 2**bits - 1) if code.isupper() else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
