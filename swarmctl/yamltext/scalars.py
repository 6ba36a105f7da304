"""Unquoted scalars: their values in the core schema of YAML 1.2, and where YAML 1.1 differs."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from swarmctl.diagnostics import Diagnostic, Edit, Fix, Span
from swarmctl.yamltext.limits import MAX_NUMBER

WORDS: dict[str, Any] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
    ".inf": math.inf, "+.inf": math.inf, "-.inf": -math.inf, ".nan": math.nan,
}  # fmt: skip
SWITCHES = {
    word: value
    for value, words in (("true", "y yes on"), ("false", "n no off"))
    for lower in words.split()
    for word in (lower, lower.capitalize(), lower.upper())
}
BEGINS_NUMBER = frozenset("+-.0123456789")

_INT = re.compile(r"[-+]?[0-9]{1,18}|0o[0-7]{1,20}|0x[0-9a-fA-F]{1,16}", re.ASCII)
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)

# Numbers and dates of YAML 1.1 (yaml.org/type: int, float, timestamp).
_BASE_60 = re.compile(
    r"([-+]?)([1-9][0-9_]*(?::[0-5]?[0-9])+|[0-9][0-9_]*(?::[0-5]?[0-9])+\.[0-9_]*)", re.ASCII
)
_NUMBER = re.compile(r"[-+]?(0b[01_]+|0x[0-9a-fA-F_]+|[0-9][0-9_]*(\.[0-9_]*)?|\.[0-9][0-9_]*)", re.ASCII)
_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}", re.ASCII)
_EXPONENT = re.compile(r"([-+]?[0-9]*)(\.[0-9]*)?[eE]([-+]?)([0-9]+)", re.ASCII)
_ZERO_FIRST = re.compile(r"[-+]?0[0-9]+", re.ASCII)


@dataclass(frozen=True)
class Trap:
    """How YAML 1.1 reads an unquoted scalar, and how to write what is read here without ambiguity."""

    code: str
    reads: str
    better: str
    other: str = ""  # what else may be meant


def number_or_text(text: str) -> Any:
    """Returns the value of an unquoted scalar that is not in ``WORDS``."""
    if len(text) > MAX_NUMBER:
        return text
    if _INT.fullmatch(text):
        return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
    if _FLOAT.fullmatch(text) and not text.lstrip("+-").isdigit():
        return float(text)
    return text


def trap(text: str, value: Any) -> Trap | None:
    """Returns how YAML 1.1 reads an unquoted scalar, or None if it also reads ``value``."""
    if text in SWITCHES:
        return Trap("YAML010", f"`{SWITCHES[text]}`", f'"{text}"', SWITCHES[text])
    if text[:1] not in BEGINS_NUMBER or len(text) > MAX_NUMBER:
        return None
    if isinstance(value, int):
        return _other_base(text, value)
    if isinstance(value, float):
        return _exponent(text)
    if found := _BASE_60.fullmatch(text):
        return Trap("YAML009", f"the number {found[1]}{_base_60(found[2])}", f'"{text}"')
    if _DATE.fullmatch(text):
        return Trap("YAML012", "a date", f'"{text}"')
    if _NUMBER.fullmatch(text):
        return Trap("YAML012", "a number", f'"{text}"', text.replace("_", ""))
    return None


def _other_base(text: str, value: int) -> Trap | None:
    """``012`` is octal to YAML 1.1, and ``0o12`` is text."""
    if text.startswith("0o"):
        return Trap("YAML012", "text", str(value))
    if not _ZERO_FIRST.fullmatch(text):
        return None
    octal = None if set(text) & {"8", "9"} else int(text, 8)
    reads = "text" if octal is None else f"the number {octal}"
    return Trap("YAML011", reads, str(value), str(octal or f'"{text}"')) if octal != value else None


def _exponent(text: str) -> Trap | None:
    """YAML 1.1 wants a point before an exponent, and a sign in it."""
    if (found := _EXPONENT.fullmatch(text)) is None or (found[2] and found[3]):
        return None
    whole = found[1] if found[1][-1:].isdigit() else f"{found[1]}0"  # PyYAML reads `-.5e+3` as text
    return Trap("YAML012", "text", f"{whole}{found[2] or '.0'}e{found[3] or '+'}{found[4]}")


def _base_60(text: str) -> int | float:
    value: int | float = 0
    for part in text.replace("_", "").split(":"):
        value = value * 60 + (float(part) if "." in part else int(part))
    return value


def warning(text: str, found: Trap, span: Span) -> Diagnostic:
    """Returns the warning about a scalar that YAML 1.1 reads differently."""
    write = f"write {found.better}"
    return Diagnostic(
        found.code,
        f"programs that use YAML 1.1 read `{text}` as {found.reads}",
        span,
        help=(f"{write}, or {found.other} if that is meant",) if found.other else (write,),
        fix=Fix(write, (Edit(span, found.better),), safe=not found.other),
    )
