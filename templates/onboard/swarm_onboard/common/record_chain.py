"""The chain of a robot's record of commands: each line has a number and the SHA-256 of the line before. Pure.

A record is a file and the one before it: when a file is full, it replaces the older one.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from hashlib import sha256
from typing import Any, Mapping

FILE, OLDER = "commands.jsonl", "commands-older.jsonl"
FULL = 1 << 20  # bytes from which on a file gets no more lines


@dataclass(frozen=True)
class Head:
    """The last line of a record, or of its beginning: its number and its hash."""

    number: int = 0
    digest: str = ""


BEGINNING = Head()


def line_after(head: Head, entry: Mapping[str, Any]) -> tuple[bytes, Head]:
    """Returns the line of ``entry`` after ``head``, without its end, and the new head."""
    line = json.dumps({"number": head.number + 1, "previous": head.digest, **entry}).encode("ascii")
    return line, Head(head.number + 1, digest_of(line))


def digest_of(line: bytes) -> str:
    """Returns the hash by which the next line names this one."""
    return sha256(line).hexdigest()


def parsed(line: bytes) -> dict[str, Any] | None:
    """Returns the entry in ``line``; None if that is no line of a record."""
    try:
        entry = json.loads(line.decode("ascii"))
    except (ValueError, RecursionError):
        return None
    whole = isinstance(entry, dict) and type(entry.get("number")) is int
    return entry if whole and isinstance(entry.get("previous"), str) else None


def whole_part(content: bytes) -> tuple[int, Head]:
    """Returns how much of a file is whole, in bytes, and its head: a power cut tears lines at the end."""
    end = content.rfind(b"\n") + 1
    while end:
        start = content.rfind(b"\n", 0, end - 1) + 1
        line = content[start : end - 1]
        entry = parsed(line)
        if entry is not None:
            return end, Head(entry["number"], digest_of(line))
        end = start
    return 0, BEGINNING
