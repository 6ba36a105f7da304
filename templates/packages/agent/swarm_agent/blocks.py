"""Our lines in a file that belongs to others. Pure: bytes in, bytes out; what is not ours keeps every byte.

A block begins with the newline before its first marker, so that a file without a final newline gets one with
the block and loses it with the block.
"""

from __future__ import annotations

import re

from .errors import RefusedError


def _markers(swarm: str) -> tuple[bytes, bytes]:
    name = swarm.encode("ascii")
    return b"# >>> swarm " + name, b"# <<< swarm " + name


def _find(original: bytes, swarm: str) -> tuple[int, int, int, int] | None:
    """Returns the offsets of the block, of the begin and end of its text, and of its end."""
    begin, end = _markers(swarm)
    first = re.search(rb"^" + re.escape(begin) + rb"\r?(?:\n|\Z)", original, re.MULTILINE)
    last = re.search(rb"^" + re.escape(end) + rb"\r?(?:\n|\Z)", original, re.MULTILINE)
    if first is None and last is None:
        return None
    if first is None or last is None or last.start() < first.end():
        raise RefusedError(
            f"the block of swarm {swarm} has lost one of its two marker lines",
            "remove what is left of the block, then deploy again",
        )
    return first.start(), first.end(), last.start(), last.end()


def text_in(original: bytes, swarm: str) -> bytes | None:
    """Returns the text between the markers, or None if there is no block."""
    found = _find(original, swarm)
    return None if found is None else original[found[1] : found[2]]


def without(original: bytes, swarm: str) -> bytes:
    """Returns the file without the block."""
    found = _find(original, swarm)
    if found is None:
        return original
    before, after = original[: found[0]], original[found[3] :]
    shorter = before[:-1] if before.endswith(b"\n") else before
    joins_lines = after and not after.startswith((b"\n", b"\r\n")) and not shorter.endswith(b"\n")
    return (before if joins_lines and shorter else shorter) + after


def having(original: bytes, swarm: str, text: bytes) -> bytes:
    """Returns the file with ``text`` in the block: in its old place, else at the end.

    Raises ``RefusedError``.
    """
    begin, end = _markers(swarm)
    if text and not text.endswith(b"\n"):
        text += b"\n"
    if text_in(text, swarm) is not None:
        raise RefusedError(f"the text for the block of swarm {swarm} contains a marker line")
    found = _find(original, swarm)
    if found is None:
        return original + b"\n" + begin + b"\n" + text + end + b"\n"
    return original[: found[1]] + text + original[found[2] :]
