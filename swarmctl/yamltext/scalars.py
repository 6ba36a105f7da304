"""Unquoted scalars: their values in the core schema of YAML 1.2."""

from __future__ import annotations

import math
import re
from typing import Any

from swarmctl.yamltext.limits import MAX_NUMBER

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
