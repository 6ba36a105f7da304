"""Requests and replies as lines of text, or sized for a Python codec.

A part that may take more or less of a line never stands before one that could take the same characters, and
only single characters are repeated: so there is one way to match a line, and none is tried again and again.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from pydantic import AfterValidator, Field

from swarmctl.field_types import ConsistencyError, Model, fits_together
from swarmctl.text_patterns import matching
from swarmctl.units import Unit

_ESCAPE = r"\\(?:[dDwWsS]|[!-/:-@\[-`{-~])"
_ATOM = (
    rf"\[\^?(?:{_ESCAPE}|-(?!-)|[ -,./0-9:-@A-Za-z^_`{{}}])+\]|{_ESCAPE}|[ -#%-'\--/0-9,:->@A-Z\]_`a-z}}~]|\."
)
_TOKEN = re.compile(
    rf"(?P<group>[()])|(?P<end>\$\Z)|(?P<atom>{_ATOM})(?P<count>(?:[*+?]|\{{[0-9]{{1,3}}(?:,[0-9]{{0,3}})?\}})\??)?"
)
_CHARACTERS = [chr(code) for code in range(128)]  # a driver reads lines as ASCII


@dataclass(frozen=True)
class _Part:
    """A piece of an expression that takes characters of ``takes``."""

    text: str
    takes: frozenset[str]
    varies: bool
    optional: bool


def bounded(pattern: str) -> str:
    """Returns ``pattern`` if matching it takes linear time; raises ValueError with the reason if not."""
    try:
        parts = list(_parts(pattern))
        re.compile(pattern)
    except re.error as error:
        raise ValueError(f"`{pattern}` is not a regular expression: {error}") from None
    for number, part in enumerate(parts):
        for after in _followers(parts[number + 1 :]) if part.varies else ():
            if part.takes & after.takes:
                raise ValueError(
                    f"`{part.text}` may take what is meant for `{after.text}`, and trying each way can hold "
                    "up a robot; begin what follows with a character that the first does not take"
                )
    return pattern


def groups_of(pattern: str) -> list[frozenset[str]]:
    """Returns the characters that each group of a bounded ``pattern`` can take, in the order they open."""
    groups: list[set[str]] = []
    inside: list[set[str]] = []
    for token in _TOKEN.finditer(pattern):
        if token["group"] == "(":
            groups.append(set())
            inside.append(groups[-1])
        elif token["group"]:
            inside.pop()
        for group in inside if token["atom"] else ():
            group.update(_taken(token["atom"]))
    return [frozenset(group) for group in groups]


def _taken(atom: str) -> frozenset[str]:
    one = re.compile(atom, re.ASCII)
    return frozenset(each for each in _CHARACTERS if one.fullmatch(each))


def _parts(pattern: str) -> Iterator[_Part]:
    at = 0
    while at < len(pattern):
        token = _TOKEN.match(pattern, at)
        if token is None:
            raise ValueError(
                f"`{pattern[at:]}` is more than a driver understands; write characters, classes like [0-9], "
                "a group ( ) around each value, and + * ? {2} behind a character or a class"
            )
        at = token.end()
        atom, count = token["atom"], token["count"] or ""
        if atom:
            fixed = re.fullmatch(r"(\{[0-9]+\}\??)?", count) is not None
            yield _Part(
                atom + count, _taken(atom), not fixed, count[:1] in ("*", "?") or count.startswith("{0")
            )


def _followers(parts: list[_Part]) -> Iterator[_Part]:
    """What may come right behind: all up to the first that must."""
    for part in parts:
        yield part
        if not part.optional:
            return


_REQUEST = r"^[\x20-\x7e]{1,80}$"
_HEAD = r"^[!-+\--~]{1,16}$"  # printable, no blank, no comma
# Printable, or blanks; nothing that a number has, nor what may be a head.
_SEPARATOR = r"^(?:\t| +|[ ]*[!-*,/:-@\[-`{-~]{1,4}[ ]*)$"
_DIGITS = frozenset("0123456789")
_LONGEST = 64  # values of a line, and a separator before each

#: What a request may be given.
SIDES, INDEX, VALUE, VALUES = ("left", "right"), "index", "value", "values"


def _pattern(value: str) -> str:
    if re.compile(bounded(value)).groups == 0:
        raise ValueError("no value of the reply is a group; write each one like (-?[0-9]+)")
    return value


Request = Annotated[str, matching(
    _REQUEST, "a request is 1 to 80 printable ASCII characters, such as `S,{left},{right}`", examples=["R"],
)]  # fmt: skip
Separator = Annotated[str, matching(
    _SEPARATOR, "a tab, blanks, or up to four signs such as `;` or `: `, without letters, digits and + - .",
    max_length=8, examples=[" "],
)]  # fmt: skip
Head = Annotated[str, matching(
    _HEAD, "1 to 16 printable ASCII characters without blanks and commas, such as `s`", examples=["r"],
)]  # fmt: skip
Pattern = Annotated[str, Field(max_length=200, examples=["([0-9]+)"]), AfterValidator(_pattern)]
Timeout = Annotated[
    float,
    Field(
        ge=0.01,
        le=2,
        examples=[0.25],
        description="Time until the reply begins, where that is not `reply_timeout`: the driver waits so "
        "long, and then for as long as the reply takes on the line.",
    ),
    Unit("s"),
]


FirmwareText = Annotated[
    Request,
    Field(
        examples=["GCtronic"],
        description="Text in the reply to `identify` without which the query is not sent: another firmware "
        "does something else with it. Its sensors are then left out.",
    ),
]


class LineExchange(Model):
    """One request and its reply: a head, then numbers, all separated by the protocol's `separator`."""

    send: Request = Field(description="The request, without its terminator.")
    reply: Head = Field(description="The head that the reply begins with.")
    values: int = Field(0, ge=0, le=_LONGEST, description="How many numbers of the reply are used.")
    extra: int = Field(
        0, ge=0, le=_LONGEST, description="How many more numbers may follow; they are ignored."
    )
    pattern: Pattern | None = Field(
        None,
        description="For a reply that is not a list of numbers: what follows the head and its separator, as "
        "a regular expression with a group for each number. Only characters and classes are repeated, and "
        "none before what it could take itself.",
    )

    @fits_together
    def _a_group_for_each_value(self) -> Iterator[ConsistencyError]:
        if self.pattern is not None and re.compile(self.pattern).groups != self.values:
            yield ConsistencyError(
                f"`pattern` needs {self.values} groups, one for each of `values`", "pattern"
            )
        for number, characters in enumerate(groups_of(self.pattern or "")):
            if not characters & _DIGITS:
                yield ConsistencyError(
                    f"group {number + 1} of `pattern` can never be a number; write one like (-?[0-9]+)",
                    "pattern",
                )

    def length(self, digits: int, gap: int = 1) -> tuple[int, int]:
        """Bytes of the request and of its longest reply, whose numbers have ``digits`` characters each.

        ``gap`` bytes stand before each number, CR and LF behind all. What is ignored may be a 32-bit number.
        """
        numbers = self.values * (gap + digits) + self.extra * (gap + 10)
        return len(self.send) + 1, len(self.reply) + numbers + 2


class Query(LineExchange):
    """A query, and the numbers of its reply."""

    timeout: Timeout | None = None
    firmware: FirmwareText | None = None


class SpeedCommand(LineExchange):
    """The request that sets both wheel speeds, with {left} and {right} where the units go."""

    send: Request = Field(examples=["D,{left},{right}"], description="The request, without its terminator.")
    reply: Head = Field(
        description="The head that the reply begins with. A robot that answers nothing, or that takes other "
        "speeds than its wheels', needs `kind: python`: docs/own-robot.md has one that confirms nothing."
    )

    @fits_together
    def _both_sides(self) -> Iterator[ConsistencyError]:
        if any(self.send.count(f"{{{side}}}") != 1 for side in SIDES):
            yield ConsistencyError("`send` of `set_speed` needs {left} and {right}, once each", "send")


class Setup(Model):
    """A request that prepares the robot, and the reply that confirms it."""

    send: Request = Field(examples=["C,0,d31"], description="The request, without its terminator.")
    reply: Head = Field(examples=["c"], description="The head that the reply begins with.")


class Identify(Model):
    """The request that names the firmware. Its version is the first number in the reply."""

    send: Request = Field(description="The request, without its terminator.")
    reply: Head = Field(description="The head that the reply begins with; text follows after a separator.")


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
    """A query, and how many numbers its reply has."""

    request: int = Field(
        ge=0,
        le=4096,
        examples=[8],
        description="Bytes of the longest request; 0 where the robot sends the line by itself: the driver "
        "then waits for the next one.",
    )
    timeout: Timeout | None = None
    firmware: FirmwareText | None = None
    values: int = Field(
        ge=1, le=255, examples=[2], description="How many numbers the class makes of the reply."
    )


def is_text(send: str) -> bool:
    """Returns True if ``send`` is a request that a line protocol can send."""
    return re.fullmatch(_REQUEST, send) is not None


def is_head(reply: str) -> bool:
    """Returns True if ``reply`` is a reply that a line protocol can match."""
    return re.fullmatch(_HEAD, reply) is not None


def places_of(send: str) -> frozenset[str]:
    """Returns the names of the places of a request, whichever way it is written."""
    return frozenset(re.findall(r"\{([a-z]+)(?::[bBhHiIf])?\}", send))
