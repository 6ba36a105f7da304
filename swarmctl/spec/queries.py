"""What is asked of a robot, and what it answers: as a line of text, as bytes, or as a class makes it."""

from __future__ import annotations

import math
import re
import struct
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from swarmctl.spec.patterns import bounded
from swarmctl.spec.words import MisfitError, Model

_REQUEST = r"^[\x20-\x7e]{1,80}$"
_HEAD = r"^[!-+\--~]{1,16}$"  # printable, no blank, no comma
_BYTE = re.compile(r"[0-9a-fA-F]{2}")
_PLACE = re.compile(r"\{(?P<name>[a-z]+):(?P<code>[bBhHiIf])\}")
_LAYOUT = re.compile(r"(?P<count>[1-9][0-9]{0,2})?(?P<code>[bBhHiIf])")
_LONGEST = 64  # values of a line, and a comma before each

#: What a request may be given.
SIDES, INDEX, VALUE, VALUES = ("left", "right"), "index", "value", "values"


def _pattern(value: str) -> str:
    if re.compile(bounded(value)).groups == 0:
        raise ValueError("each value of the reply is a group, like (-?[0-9]+)")
    return value


def binary_request(value: str) -> str:
    for token in value.split():
        if not (_BYTE.fullmatch(token) or _PLACE.fullmatch(token)):
            raise ValueError(
                f"`{token}` is neither a byte in two hexadecimal digits nor a place like {{left:h}}"
            )
    return value


def layout(value: str) -> str:
    for token in value.split():
        if not _LAYOUT.fullmatch(token):
            raise ValueError(f"`{token}` is no layout; write a count and one of b B h H i I f, like 8H")
    return value


Request = Annotated[str, Field(pattern=_REQUEST, examples=["R"])]
Head = Annotated[str, Field(pattern=_HEAD, examples=["r"])]
Pattern = Annotated[str, Field(max_length=200, examples=["([0-9]+)"]), AfterValidator(_pattern)]
Bytes = Annotated[
    str, Field(min_length=2, max_length=400, examples=["af 00"]), AfterValidator(binary_request)
]
Layout = Annotated[str, Field(max_length=80, examples=["2h"]), AfterValidator(layout)]


class Query(Model):
    """One request and its reply: a head, then numbers, all separated by commas."""

    send: Request = Field(description="The request, without its terminator.")
    reply: Head = Field(description="The head that the reply begins with.")
    values: int = Field(0, ge=0, le=_LONGEST, description="How many numbers of the reply are used.")
    extra: int = Field(
        0, ge=0, le=_LONGEST, description="How many more numbers may follow; they are ignored."
    )
    pattern: Pattern | None = Field(
        None,
        description="For a reply that is no list of numbers: what follows the head and its comma, as a "
        "regular expression with a group for each number. Only characters and classes are repeated, and none "
        "before what it could take itself.",
    )

    @model_validator(mode="after")
    def _a_group_for_each_value(self) -> Query:
        if self.pattern is not None and re.compile(self.pattern).groups != self.values:
            raise MisfitError(f"`pattern` needs as many groups as `values` says: {self.values}", "pattern")
        return self

    def length(self, digits: int) -> tuple[int, int]:
        """Bytes of the request and of its longest reply, whose numbers have ``digits`` characters each.

        A comma stands before each number, CR and LF behind all. What is ignored may be a 32-bit number.
        """
        return len(self.send) + 1, len(self.reply) + self.values * (1 + digits) + self.extra * 11 + 2


class SpeedCommand(Query):
    """The request that sets both wheel speeds, with {left} and {right} where the units go."""

    send: Request = Field(examples=["D,{left},{right}"], description="The request, without its terminator.")

    @model_validator(mode="after")
    def _both_sides(self) -> SpeedCommand:
        if any(self.send.count(f"{{{side}}}") != 1 for side in SIDES):
            raise MisfitError("`send` of `set_speed` needs {left} and {right}, once each", "send")
        return self


class Setup(Model):
    """A request that prepares the robot, and the reply that confirms it."""

    send: Request = Field(examples=["C,0,d31"], description="The request, without its terminator.")
    reply: Head = Field(examples=["c"], description="The head that the reply begins with.")


class Identify(Model):
    """The request that names the firmware. Its version is the first number in the reply."""

    send: Request = Field(description="The request, without its terminator.")
    reply: Head = Field(description="The head that the reply begins with; text follows after a comma.")


class BinaryQuery(Model):
    """One request and its reply as bytes: a request in hexadecimal digits, a reply of known layout."""

    send: Bytes = Field(description="The request: bytes in hexadecimal digits, each by itself.")
    reply: Layout = Field(
        "",
        description="What comes back, value by value: b B h H i I f as Python's `struct` has them, a "
        "count before them where they repeat. Empty for a robot that does not answer.",
    )

    @property
    def values(self) -> int:
        """How many numbers the reply has."""
        found = (_LAYOUT.fullmatch(token) for token in self.reply.split())
        return sum(int(one["count"] or 1) for one in found if one is not None)

    @model_validator(mode="after")
    def _places(self) -> BinaryQuery:
        """None here: nothing would fill them."""
        place = _PLACE.search(self.send)
        if place is not None:
            raise MisfitError(f"nothing fills `{place.group()}` here; write the bytes themselves", "send")
        return self

    def length(self, _: int) -> tuple[int, int]:
        """Bytes of the request and of its reply."""
        sizes = (_PLACE.fullmatch(token) for token in self.send.split())
        request = sum(struct.calcsize("<" + one["code"]) if one else 1 for one in sizes)
        return request, struct.calcsize("<" + self.reply.replace(" ", ""))


class BinarySpeedCommand(BinaryQuery):
    """The request that sets both wheel speeds, with {left:h} and {right:h} where the units go."""

    send: Bytes = Field(
        examples=["bc {left:h} {right:h} bb 00"],
        description="The request, with a place and its layout where the units of each side go.",
    )
    echo: bool = Field(
        False,
        description="Whether the reply repeats both speeds as ordered; another answer is then an error.",
    )

    @model_validator(mode="after")
    def _places(self) -> BinarySpeedCommand:
        if sorted(one["name"] for one in _PLACE.finditer(self.send)) != sorted(SIDES):
            raise MisfitError("`send` of `set_speed` needs {left:h} and {right:h}, once each", "send")
        if self.echo and self.values != len(SIDES):
            raise MisfitError("an echo has two values; mend `reply` or leave `echo` out", "reply")
        return self


class CodedExchange(Model):
    """One request and its reply as a class of your own makes and reads them: here are their sizes only."""

    request: int = Field(ge=1, le=4096, examples=[8], description="Bytes of the longest request.")
    reply: int = Field(
        ge=0,
        le=4096,
        examples=[4],
        description="Bytes of the longest reply; 0 for a robot that does not answer.",
    )

    def length(self, _: int) -> tuple[int, int]:
        """Bytes of the request and of its longest reply."""
        return self.request, self.reply


class CodedQuery(CodedExchange):
    """A question, and how many numbers its reply makes."""

    values: int = Field(
        ge=1, le=255, examples=[2], description="How many numbers the class makes of the reply."
    )


def is_binary(send: str) -> bool:
    """Whether the places of a request have a layout, as those of bytes do."""
    return _PLACE.search(send) is not None


def room_of(send: str, *names: str) -> tuple[float, float]:
    """The smallest and the largest number that all places of a request in bytes with these names hold."""
    bounds = [_bounds(one["code"]) for one in _PLACE.finditer(send) if one["name"] in names]
    return max(low for low, _ in bounds), min(high for _, high in bounds)


def _bounds(code: str) -> tuple[float, float]:
    if code == "f":
        return -math.inf, math.inf
    bits = 8 * struct.calcsize("<" + code)
    return (0, 2**bits - 1) if code.isupper() else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def is_text(send: str) -> bool:
    return re.fullmatch(_REQUEST, send) is not None


def is_head(reply: str) -> bool:
    return re.fullmatch(_HEAD, reply) is not None


def places_of(send: str) -> frozenset[str]:
    """The names of the places of a request, whichever way it is written."""
    return frozenset(re.findall(r"\{([a-z]+)(?::[bBhHiIf])?\}", send))
