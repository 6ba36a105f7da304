"""Units of quantities: text such as `28.5 cm` as a number in a key's own unit. Knows no key.

Only ``NUMBER UNIT`` with a unit of the tables below is read; pint, which converts, is given no other text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from typing import Any

from pydantic import BeforeValidator, GetCoreSchemaHandler, GetJsonSchemaHandler

from swarmctl.suggest import nearest

X_UNIT = "x-unit"  # the word of a JSON Schema that holds a key's unit
_LONGEST = 40  # characters of a quantity
_NUMBER = r"[-+]?(?:[0-9]{1,15}(?:\.[0-9]{0,15})?|\.[0-9]{1,15})(?:[eE][-+]?[0-9]{1,2})?"
_PLAIN = re.compile(_NUMBER, re.ASCII)
_SPACE = " \u00a0\u2009\u202f"  # what publishers put before a unit reads as a blank
# No digit in it but a square: `1.2.3`, `1_000` and `1e400` are not quantities.
_UNIT = r"1/[A-Za-z]+|[^\W\d_][^\d_]*[²2]?|[°\"'\u2032\u2033%][^\d]*"
_QUANTITY = re.compile(rf"(?P<number>{_NUMBER})(?P<space>[{_SPACE}]*)(?P<unit>{_UNIT})")
_COMMA = re.compile(
    rf"(?P<whole>[-+]?[0-9]{{1,15}}),(?P<part>[0-9]{{1,15}})(?P<rest>[{_SPACE}]*[^,]*)", re.ASCII
)

_LENGTHS = {
    "m": "meter", "cm": "centimeter", "mm": "millimeter", "dm": "decimeter", "km": "kilometer",
    "um": "micrometer", "µm": "micrometer", "nm": "nanometer", "in": "inch", "ft": "foot",
}  # fmt: skip
_ANGLES = {"deg": "degree", "°": "degree", "rad": "radian", "mrad": "milliradian", "turn": "turn"}
_TIMES = {
    "s": "second", "ms": "millisecond", "us": "microsecond", "µs": "microsecond", "min": "minute",
    "h": "hour",
}  # fmt: skip
_RATES = {"Hz": "hertz", "kHz": "kilohertz", "1/s": "1/second", "1/min": "1/minute"}
_SPEEDS = {
    "m/s": "meter/second", "cm/s": "centimeter/second", "mm/s": "millimeter/second", "m/min": "meter/minute",
    "km/h": "kilometer/hour", "in/s": "inch/second", "ft/s": "foot/second", "mph": "mile/hour",
}  # fmt: skip
_TURNS = {
    "rad/s": "radian/second", "deg/s": "degree/second", "°/s": "degree/second",
    "mrad/s": "milliradian/second", "turn/s": "turn/second", "rpm": "turn/minute",
}  # fmt: skip
_ACCELERATIONS = {
    f"{length}/{square}": f"{name}/second**2"
    for length, name in (("m", "meter"), ("cm", "centimeter"), ("mm", "millimeter"))
    for square in ("s²", "s2", "s^2")
}
_VOLTAGES = {"V": "volt", "mV": "millivolt", "uV": "microvolt", "µV": "microvolt", "kV": "kilovolt"}
_SIZES = {
    "B": "byte", "kB": "kilobyte", "MB": "megabyte", "GB": "gigabyte", "TB": "terabyte",
    "KiB": "kibibyte", "MiB": "mebibyte", "GiB": "gibibyte",
}  # fmt: skip
_BIT_RATES = {
    "bit/s": "bit/second", "kbit/s": "kilobit/second", "Mbit/s": "megabit/second", "Gbit/s": "gigabit/second",
    "bps": "bit/second", "kbps": "kilobit/second", "Mbps": "megabit/second", "Gbps": "gigabit/second",
    "kB/s": "kilobyte/second", "MB/s": "megabyte/second", "GB/s": "gigabyte/second",
}  # fmt: skip
_BAUDS = {"baud": "bit/second", "Bd": "bit/second", "kbaud": "kilobit/second", "kBd": "kilobit/second"}

# Units by what they measure, the first of each in messages; with an example.
_KINDS: tuple[tuple[str, Mapping[str, str], str], ...] = (
    ("length", _LENGTHS, "28.5 cm"),
    ("angle", _ANGLES, "0.7 rad"),
    ("time", _TIMES, "200 ms"),
    ("rate", _RATES, "10 Hz"),
    ("speed", _SPEEDS, "30 cm/s"),
    ("turning speed", _TURNS, "90 deg/s"),
    ("acceleration", _ACCELERATIONS, "50 cm/s²"),
    ("voltage", _VOLTAGES, "20 mV"),
    ("size in bytes", _SIZES, "2 GB"),
    ("bit rate", {**_BIT_RATES, **_BAUDS}, "35 Mbit/s"),
)
_KIND_OF = {unit: kind for kind, units, _ in _KINDS for unit in units}
# Other ways to write a unit that leave no doubt which is meant.
_OTHER_WORDS = {
    '"': "in", "''": "in", "\u2033": "in", "inch": "in", "inches": "in", "'": "ft", "\u2032": "ft",
    "feet": "ft", "foot": "ft", "meter": "m", "meters": "m", "metre": "m", "metres": "m",
    "sec": "s", "secs": "s", "seconds": "s", "msec": "ms", "minutes": "min", "hours": "h",
    "degree": "deg", "degrees": "deg", "degs": "deg", "radians": "rad", "rads": "rad", "volt": "V",
    "volts": "V", "mps": "m/s", "kmh": "km/h", "km/hr": "km/h", "kph": "km/h", "rev/s": "turn/s",
    "rev/min": "rpm", "kb/s": "kbit/s", "Mb/s": "Mbit/s", "Gb/s": "Gbit/s",
}  # fmt: skip


_OF_NO_KEY = ("kg", "g", "lb", "N", "Nm", "A", "mA", "Ah", "W", "K")  # right, and of other quantities


class UnitError(ValueError):
    """Text that is not a quantity of a key's kind; ``meant`` is what it should be, where that is certain."""

    def __init__(self, message: str, meant: str | None = None) -> None:
        super().__init__(message)
        self.meant = meant


@dataclass(frozen=True)
class Unit:
    """The unit of a number, as metadata of its type: ``Annotated[float, Unit("m")]``. Text may name another.

    ``symbol`` is one of the tables above.
    """

    symbol: str

    @property
    def kind(self) -> str:
        """What it measures, such as ``length``."""
        return _KIND_OF[self.symbol]

    @property
    def example(self) -> str:
        """A quantity of its kind."""
        return next(example for kind, _, example in _KINDS if kind == self.kind)

    @property
    def others(self) -> tuple[str, ...]:
        """Every unit of its kind."""
        return next(tuple(units) for kind, units, _ in _KINDS if kind == self.kind)

    def pattern(self) -> str:
        """A regular expression of JSON Schema for a number with a unit of its kind."""
        words = "|".join(one.replace("^", r"\^") for one in self.others)
        return rf"^[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)? ?({words})$"

    def read(self, value: Any) -> Any:
        """Returns the number in this unit that ``value`` writes with a unit, and anything else as it is."""
        if not isinstance(value, str) or not value[:1] or value[0] not in "+-.0123456789":
            return value
        if len(value) > _LONGEST or _PLAIN.fullmatch(value):
            return value
        if found := _COMMA.fullmatch(value):
            raise self._with_comma(value, found)
        found = _QUANTITY.fullmatch(value)
        if found is None:
            return value
        unit = found["unit"].replace("μ", "µ")  # the Greek letter, for the sign that keyboards have
        if unit not in self.others:
            raise self._not_one(value, found["number"], unit)
        return float(Decimal(found["number"]) * _factor(unit, self.symbol))

    def _with_comma(self, value: str, found: re.Match[str]) -> UnitError:
        point = f"{found['whole']}.{found['part']}{found['rest']}"
        message = f"`{value}` has a comma; write a decimal point: {point}"
        if len(found["part"]) == 3:  # may separate thousands
            return UnitError(f"{message}, or {found['whole']}{found['part']}{found['rest']}")
        return UnitError(message, point if self._is_quantity(point) else None)

    def _is_quantity(self, value: str) -> bool:
        try:
            return _PLAIN.fullmatch(value) is not None or self.read(value) != value
        except UnitError:
            return False

    def _not_one(self, value: str, number: str, unit: str) -> UnitError:
        how = f"write it in {self.symbol}, or with its unit, like {self.example}"
        if (kind := _KIND_OF.get(unit)) is not None:
            return UnitError(f"`{value}` is {_a(kind)}, and this is {_a(self.kind)}; {how}")
        same = [
            one for one in self.others if one.lower() == unit.lower() and one.count("B") == unit.count("B")
        ]  # b and B are bits and bytes
        meant = _OTHER_WORDS.get(unit) or (same[0] if len(same) == 1 else None)
        if meant in self.others:
            return UnitError(
                f"`{value}` has a unit that swarmctl does not know; write {number} {meant}",
                f"{number} {meant}",
            )
        what, use = f"`{unit}` is not a unit of {_a(self.kind)}", f"use one of {', '.join(self.others)}"
        near = self._near(unit)
        return UnitError(f"{what}; did you mean `{number} {near}`?" if near else f"{what}; {use}")

    def _near(self, unit: str) -> str | None:
        """A unit with the same beginning; short words have too few letters to be alike."""
        if unit in _OF_NO_KEY:
            return None
        alike = [one for one in self.others if one[0] == unit[0] and len(one) == len(unit)]
        return alike[0] if len(alike) == 1 else nearest(unit, self.others) if len(unit) > 2 else None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        """Reads text with a unit, before the number is checked."""
        read = self._read_whole if handler(source)["type"] == "int" else self.read
        return BeforeValidator(read).__get_pydantic_core_schema__(source, handler)

    def _read_whole(self, value: Any) -> Any:
        """Reads a whole number; one of a coarser unit is rounded, as 1 GiB is not a whole number of MB."""
        read = self.read(value)
        return round(read) if isinstance(value, str) and isinstance(read, float) else read

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Notes the unit; `with_unit` makes of it what editors understand."""
        return {**handler(schema), X_UNIT: self.symbol}


def with_unit(node: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the JSON Schema of a number that has a unit: text may name another; bounds are the number's."""
    unit = Unit(node[X_UNIT])
    kinds = node["type"] if isinstance(node["type"], list) else [node["type"], "string"]
    made = {**node, "type": kinds, "pattern": unit.pattern()}
    if "description" in node:
        made["description"] = described_with(node["description"], unit.symbol)
    return made


def described_with(description: str, unit: str) -> str:
    """Returns the description of a key with its unit."""
    named = f"Unit: {unit}."
    return description if description.endswith(named) else f"{description} {named}".lstrip()


def _a(noun: str) -> str:
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"


@cache
def _factor(unit: str, into: str) -> Decimal:
    """How many of ``into`` one ``unit`` is; both are of one kind."""
    if unit == into:
        return Decimal(1)
    names = {unit: name for _, units, _ in _KINDS for unit, name in units.items()}
    factor = _registry().Quantity(Decimal(1), names[unit]).to(names[into]).magnitude
    return Decimal(factor)


@cache
def _registry() -> Any:
    import pint  # noqa: PLC0415  (loads for 0.4 s, and few specs have units)

    return pint.UnitRegistry(non_int_type=Decimal)
