"""Keeps the texts of launch files that were read on hosts, so that an unchanged one is not sent again."""

from __future__ import annotations

import contextlib
from hashlib import sha256

from swarmctl.deploy.bounded_folder import BoundedFolder
from swarmctl.resources import cache_folder

_MAX_BYTES = 64 << 20


def find(digest: str) -> str | None:
    """Returns the text with this SHA-256; None if it is not kept, or damaged."""
    content = _files().find(digest) if len(digest) == 64 and digest.isalnum() else None
    return content.decode() if content is not None and sha256(content).hexdigest() == digest else None


def keep(text: str) -> None:
    """Stores a text; where that fails, it is sent again the next time."""
    content = text.encode()
    with contextlib.suppress(OSError):
        _files().keep(sha256(content).hexdigest(), content)


def _files() -> BoundedFolder:
    return BoundedFolder(cache_folder() / "launch", ".txt", _MAX_BYTES)
