"""What a name may consist of. ``re`` takes longer to load than these checks."""

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
