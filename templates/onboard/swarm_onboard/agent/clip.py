"""Shortens text from others so that it fits into an answer."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def clipped(value: Any, longest: int = 200) -> str:
    """Returns ``value`` as text of at most ``longest`` characters."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return text if len(text) <= longest else text[: longest - 3] + "..."
