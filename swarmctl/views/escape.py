"""Makes foreign text safe for a terminal."""

from __future__ import annotations

import unicodedata

_UNSAFE = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}


def printable(text: str) -> str:
    """``text`` with control, bidirectional and invisible characters as escapes; tabs become one blank."""
    if text.isprintable():  # that is almost every line, and a line may have millions of letters
        return text
    return "".join(
        " " if char == "\t" else char if unicodedata.category(char) not in _UNSAFE else _escape(char)
        for char in text
    )


def _escape(char: str) -> str:
    code = ord(char)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
