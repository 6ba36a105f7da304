"""Patterns of texts, each with what it allows in words: an error message never shows a regular expression."""

from __future__ import annotations

from typing import Any

from pydantic import Field

_WORDS: dict[str, str] = {}


def matching(pattern: str, words: str, **more: Any) -> Any:
    """Returns the ``Field`` of a text that has this pattern, with ``more`` of its parameters."""
    assert _WORDS.setdefault(pattern, words) == words, f"two descriptions of {pattern}"
    return Field(pattern=pattern, **more)


def words_of(pattern: str) -> str:
    """Returns what a pattern allows."""
    return _WORDS[pattern]
