"""Text from others: what a name may consist of, and how long a text in an answer is."""

from __future__ import annotations

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any


_LETTERS = "abcdefghijklmnopqrstuvwxyz"
_FIRST = frozenset(_LETTERS + _LETTERS.upper() + "0123456789")


def is_name(value: Any, also: str, longest: int) -> bool:
    """Returns True if ``value`` is a text of at most ``longest`` ASCII letters, digits, and of ``also``.

    It begins with a letter or digit.
    """
    return (
        isinstance(value, str)
        and 0 < len(value) <= longest
        and value[0] in _FIRST
        and _FIRST.issuperset(set(value).difference(also))
    )


def clipped(value: Any, longest: int = 200) -> str:
    """Returns ``value`` as text of at most ``longest`` characters."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return text if len(text) <= longest else text[: longest - 3] + "..."
