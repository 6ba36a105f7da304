"""Our lines in a file that belongs to others. Pure: bytes in, bytes out; what is not ours keeps every byte.

A block begins with the newline before its first marker, so that a file without a final newline gets one with
the block and loses it with the block.
"""

from __future__ import annotations

from .errors import RefusedError


def _markers(swarm: str) -> tuple[bytes, bytes]:
    name = swarm.encode("ascii")
    return b"# >>> swarm " + name, b"# <<< swarm " + name


def _find(original: bytes, swarm: str) -> tuple[int, int, int, int] | None:
    """Returns the offsets of the block, of the begin and end of its text, and of its end."""
    begin, end = _markers(swarm)
    first, last = _line(original, begin), _line(original, end)
    if first is None and last is None:
        return None
    if first is None or last is None or last[0] < first[1]:
        raise RefusedError(
            f"the block of swarm {swarm} has lost one of its two marker lines",
            "remove what is left of the block, then deploy again",
        )
    return (*first, *last)


def _line(original: bytes, marker: bytes) -> tuple[int, int] | None:
    """Returns the offsets of the first line that is ``marker``, and of the next line."""
    start = original.find(marker)
    while start >= 0:
        end = start + len(marker)
        if start == 0 or original.startswith(b"\n", start - 1):
            for ending in (b"\n", b"\r\n"):
                if original.startswith(ending, end):
                    return start, end + len(ending)
            if original[end:] in (b"", b"\r"):
                return start, len(original)
        start = original.find(marker, end)
    return None


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
