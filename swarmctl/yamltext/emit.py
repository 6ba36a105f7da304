"""Writes values as YAML text that YAML 1.1 and 1.2 read alike."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

import yaml

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
