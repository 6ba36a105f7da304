"""Characters around a value that are no part of it: curly quotes, a comma at its end, a comment's sign."""

from __future__ import annotations

import re
from collections.abc import Callable

_CURLY = "\u2018-\u201f\u00ab\u00bb\u2039\u203a"
# The value within, and how to write it.
_FORMS = (
    (re.compile(f"[{_CURLY}](?P<value>[^{_CURLY}]+)[{_CURLY}]"), "YAML knows straight quotes only: write {}"),
    (
        re.compile(r"(?P<value>.*[^,;\s])\s*[,;]"),
        "a line of YAML ends without a comma or semicolon: write {}",
    ),
    (
        re.compile(r"(?P<value>[^\s#/]+)\s*(?:#|//).*"),
        "a comment begins with a blank and `#`: write {} # ...",
    ),
)


def value_within(text: str, fits: Callable[[str], bool]) -> tuple[str, str] | None:
    """Returns the value that ``fits`` within ``text``, and help; None if ``text`` has no such characters."""
    for form, help_ in _FORMS:
        found = form.fullmatch(text)
        if found is not None and fits(found["value"]):
            return found["value"], help_.format(found["value"])
    return None
