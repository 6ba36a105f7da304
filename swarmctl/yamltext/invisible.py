"""Characters that a reader cannot see or takes for a blank: copied text brings them into a spec."""

from __future__ import annotations

import unicodedata


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
