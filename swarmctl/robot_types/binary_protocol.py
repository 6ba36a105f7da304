"""Requests and replies in bytes: tokens that are a byte in hexadecimal digits or a place for a value."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping
from itertools import takewhile
from typing import Annotated

from pydantic import AfterValidator, Field

from swarmctl.field_types import ConsistencyError, Model, fits_together
from swarmctl.robot_types.line_protocol import SIDES, FirmwareText, Head, Timeout

_BYTE = re.compile(r"[0-9a-fA-F]{2}")
_PLACE = re.compile(r"\{(?P<name>[a-z]+):(?P<code>[bBhHiIf])\}")
_LAYOUT = re.compile(r"(?P<count>[1-9][0-9]{0,3})?(?P<code>[bBhHiIf])")
_DATA = re.compile(r"\{[a-z]+\}")


def binary_request(value: str, place: re.Pattern[str] = _PLACE, hint: str = "a place like {left:h}") -> str:
    """Returns ``value`` if it is a request of hexadecimal bytes and places. Raises ``ValueError``."""
    for token in value.split():
        if not (_BYTE.fullmatch(token) or place.fullmatch(token)):
            raise ValueError(
                f"`{token}` is neither a byte nor a place; write two hexadecimal digits, or {hint}"
            )
    return value


def layout(value: str) -> str:
    """Returns ``value`` if it is the layout of a reply. Raises ``ValueError``."""
    for token in value.split():
        if not _LAYOUT.fullmatch(token):
            raise ValueError(no_layout(token))
    return value


def no_layout(token: str) -> str:
    """Returns the error about a token of a reply."""
    return f"`{token}` is not a layout; write a count and one of b B h H i I f, like 8H"


def _is_place(token: str) -> bool:
    """True for a token that the sensor fills which reads the reply: one of its settings, or its data."""
    return bool(_PLACE.fullmatch(token) or _DATA.fullmatch(token))


def _answer(value: str) -> str:
    layout(" ".join(one for one in value.split() if not _is_place(one)))
    return value


def _plain(value: str) -> str:
    """Rejects places: nothing fills them here."""
    place = _PLACE.search(binary_request(value))
    if place is not None:
        raise ValueError(f"nothing fills `{place.group()}` here; write the bytes themselves")
    return value


Bytes = Annotated[str, Field(min_length=2, max_length=400, examples=["af 00"])]
PlainBytes = Annotated[Bytes, AfterValidator(_plain)]
Layout = Annotated[str, Field(max_length=80, examples=["2h"]), AfterValidator(layout)]
Answer = Annotated[str, Field(max_length=80, examples=["2h"]), AfterValidator(_answer)]


class BinaryExchange(Model):
    """One request and its reply as bytes: a request in hexadecimal digits, a reply of known layout."""

    send: PlainBytes = Field(description="The request: bytes in hexadecimal digits, each by itself.")
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
        """One letter a number of the reply, as `struct` has them; its data is not among them."""
        tokens = [_LAYOUT.fullmatch(one) or _PLACE.fullmatch(one) for one in self.reply.split()]
        return "".join(one["code"] * int(one.groupdict().get("count") or 1) for one in tokens if one)

    @property
    def values(self) -> int:
        """How many numbers the reply has."""
        return len(self.codes)

    @fits_together
    def _check_begins(self) -> Iterator[ConsistencyError]:
        if len(self.begins) > self.values:
            yield ConsistencyError(
                f"`begins` has {len(self.begins)} numbers, the reply {self.values}", "begins"
            )
        for number, code in zip(self.begins, self.codes, strict=False):
            low, high = bounds_of(code)
            if not low <= number <= high:
                yield ConsistencyError(
                    f"no reply begins with {number} where `reply` has {code}; correct `begins`", "begins"
                )

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
        "count before them where they repeat. That for a sensor of kind `image` ends with {pixels}, and has "
        "{mode:B}, {width:B} and the like where it repeats how the sensor is set.",
    )
    timeout: Timeout | None = None
    firmware: FirmwareText | None = None

    @property
    def places(self) -> tuple[str, ...]:
        """What the sensor fills that reads it: `{name:code}` is one of its settings, `{name}` its data."""
        return tuple(filter(_is_place, self.reply.split()))

    def filled(self, settings: Mapping[str, int], count: int) -> BinaryQuery:
        """The query whose reply begins with the values of ``settings`` and ends with ``count`` bytes of data.

        A number that does not fit its place is cut to its lowest bytes.
        """
        places = takewhile(bool, map(_PLACE.fullmatch, self.reply.split()))
        repeated = tuple(within(settings[one["name"]], one["code"]) for one in places if one)
        reply = f"{' '.join(self.codes)} {count}B".strip()
        return self.model_copy(update={"reply": reply, "begins": repeated or self.begins})


class BinaryIdentify(Model):
    """The request that names the firmware, answered by a line of text. Its version is the first number."""

    send: PlainBytes = Field(
        examples=["56 0d"], description="The request: bytes in hexadecimal digits, each by itself."
    )
    reply: Head = Field(
        examples=["v"], description="The head that the line begins with; text follows after a comma."
    )


class BinarySpeedCommand(BinaryExchange):
    """The request that sets both wheel speeds, with {left:h} and {right:h} where the units go."""

    send: Annotated[Bytes, AfterValidator(binary_request)] = Field(
        examples=["bc {left:h} {right:h} bb 00"],
        description="The request, with a place and its layout where the units of each side go.",
    )
    echo: bool = Field(
        False,
        description="Whether the reply repeats both speeds of the command; another reply is then an error.",
    )

    @fits_together
    def _places(self) -> Iterator[ConsistencyError]:
        if sorted(one["name"] for one in _PLACE.finditer(self.send)) != sorted(SIDES):
            yield ConsistencyError("`send` of `set_speed` needs {left:h} and {right:h}, once each", "send")
        if self.echo and (self.values != len(SIDES) or self.begins):
            yield ConsistencyError(
                "an echo has two values; correct `reply`, or leave `echo` or `begins` out", "reply"
            )


def is_binary(send: str) -> bool:
    """Returns True if the places of a request have a layout, as those of bytes do."""
    return _PLACE.search(send) is not None


def value_range(send: str, *names: str) -> tuple[float, float]:
    """Returns the smallest and largest number that all places with these names in a request hold."""
    bounds = [bounds_of(one["code"]) for one in _PLACE.finditer(send) if one["name"] in names]
    return max(low for low, _ in bounds), min(high for _, high in bounds)


def within(number: int, code: str) -> int:
    """Returns the lowest bytes of a number, as many as its place has."""
    if code == "f":
        return number
    low, high = bounds_of(code)
    return int((number - low) % (high - low + 1) + low)


def bounds_of(code: str) -> tuple[float, float]:
    """Returns the smallest and largest number of one letter of a layout."""
    if code == "f":
        return -math.inf, math.inf
    bits = 8 * struct.calcsize("<" + code)
    return (0, 2**bits - 1) if code.isupper() else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
