"""Scalars as YAML 1.1 and 1.2 read them: their values, how they are written, invisible characters."""

from __future__ import annotations

import json
import math
import re
import unicodedata
from collections.abc import Mapping
from typing import Any

import yaml

from swarmctl.yamltext.files import MAX_NUMBER

WORDS: dict[str, Any] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
    ".inf": math.inf, "+.inf": math.inf, "-.inf": -math.inf, ".nan": math.nan,
}  # fmt: skip
BEGINS_NUMBER = frozenset("+-.0123456789")

_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]{1,20}|0x[0-9a-fA-F]{1,16}", re.ASCII)
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)


def number_or_text(text: str) -> Any:
    """Returns the value of an unquoted scalar that is not in ``WORDS``."""
    if len(text) > MAX_NUMBER:
        return text
    if _INT.fullmatch(text):
        return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
    if _FLOAT.fullmatch(text) and not text.lstrip("+-").isdigit():
        return float(text)
    return text


def first_invisible(text: str) -> int | None:
    """Returns where the first character is that looks like a blank or like nothing, and is no blank."""
    if text.isascii():
        return None
    found = (place for place, char in enumerate(text) if char != " " and _kind(char) in ("Zs", "Cf"))
    return next(found, None)


def named(char: str) -> str:
    """Returns the character's code and name, as in ``U+00A0 (no-break space)``."""
    return f"U+{ord(char):04X} ({unicodedata.name(char, 'no name').lower()})"


def legible(text: str) -> str:
    """Returns ``text`` with each character that would look like a blank or like nothing as its escape."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else _escape(char) for char in text)


def without_invisible(text: str) -> str:
    """Returns ``text`` with plain blanks, none at its ends, and without what has no width."""
    kinds = ((char, _kind(char)) for char in text)
    return "".join(" " if kind == "Zs" else char for char, kind in kinds if kind != "Cf").strip()


def _escape(char: str) -> str:
    return char.encode("unicode_escape").decode("ascii")


def _kind(char: str) -> str:
    return unicodedata.category(char)


_PLAIN = re.compile(r"[A-Za-z0-9_/][A-Za-z0-9_/.+@-]*( [A-Za-z0-9_/.+@-]+)*", re.ASCII)
_NUMERIC = re.compile(r"0[xo][0-9a-fA-F]+|[0-9_]+|[0-9]*\.?[0-9]*[eE][-+]?[0-9]+", re.ASCII)
_WORDS = ("y", "n")  # true and false to some readers of YAML 1.1


def literal(value: Any, quote: str = "") -> str:
    """Returns ``value`` on one line, in flow style. Text gets the quotes ``quote`` where possible."""
    if isinstance(value, Mapping):
        return (
            "{"
            + ", ".join(f"{text_of(str(key), quote)}: {literal(one, quote)}" for key, one in value.items())
            + "}"
        )
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(literal(one, quote) for one in value) + "]"
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return _float(value)
    return str(value) if isinstance(value, int) else text_of(str(value), quote)


def text_of(value: str, quote: str = "") -> str:
    """Returns a text scalar, quoted where a YAML reader would not read it as text."""
    if quote == "'" and value.isprintable():
        return "'" + value.replace("'", "''") + "'"
    if quote or not _is_plain(value):
        return _quoted(value)
    return value


def _quoted(value: str) -> str:
    """Returns text in double quotes; YAML escapes as JSON does, except beyond 16 bits."""
    written = json.dumps(value, ensure_ascii=False)
    return "".join(char if char.isprintable() else f"\\U{ord(char):08x}" for char in written)


def _is_plain(value: str) -> bool:
    if not _PLAIN.fullmatch(value) or _NUMERIC.fullmatch(value) or value.lower() in _WORDS:
        return False
    resolved = yaml.SafeLoader.yaml_implicit_resolvers.get(value[0], ())
    return not any(pattern.match(value) for _, pattern in resolved)


def _float(value: float) -> str:
    """Returns a number with a decimal point, without which YAML 1.1 reads ``1e-05`` as text."""
    if not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    digits, mark, exponent = repr(value).partition("e")
    point = "" if "." in digits else ".0"
    sign = "+" if mark and not exponent.startswith("-") and not exponent.startswith("+") else ""
    return f"{digits}{point}{mark}{sign}{exponent}"
