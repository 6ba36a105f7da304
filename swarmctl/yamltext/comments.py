"""The comments of a YAML text, and those that an edit removed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator


def lost_comments(before: str, after: str) -> Iterator[tuple[int, str]]:
    """Yields the comments of ``before`` that ``after`` lacks, with their lines."""
    left = Counter(comment for _, comment in _comments(after))
    for line, comment in _comments(before):
        left[comment] -= 1
        if left[comment] < 0:
            yield line, comment


def _comments(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.splitlines(), start=1):
        before, sign, rest = line.partition("#")
        if sign and (not before or before[-1].isspace()):
            yield number, f"# {rest.strip()}"
