"""The files of an upload that ended early, by their SHA-256: the next upload leaves them out.

Root alone reads them. They are those of one release at most, and go once a release is complete.
"""

from __future__ import annotations

import os

from . import disk, files
from .manifest import is_sha256
from .release_store import Home

LONGEST = 64 << 20  # bytes, of all files together
_MARGIN = 16 << 20  # bytes that stay free on the disk


def keep(home: Home, digest: str, received: bytes) -> None:
    """Keeps the complete files in the first bytes of an archive of release ``digest``; the lock is held.

    Those of other releases are removed. Raises ``RefusedError`` for bytes that are none, and ``OSError``.
    """
    from . import staging  # noqa: PLC0415  (loads tarfile, and few uploads end early)

    manifest, found = staging.complete(received, digest, LONGEST)
    os.makedirs(home.upload, 0o700, exist_ok=True)
    wanted = {entry.sha256 for entry in manifest.files.values()}
    for name in os.listdir(home.upload):
        if name not in wanted:
            files.remove(os.path.join(home.upload, name))
    free = disk.free(home.path) - _MARGIN
    for sha256, content in found.items():
        free -= len(content)
        if free < 0:
            return
        draft = os.path.join(home.upload, "draft")
        files.remove(draft)
        files.write_new(draft, content, 0o600)
        os.rename(draft, os.path.join(home.upload, sha256))  # not synced: the digest is checked when read


def kept(home: Home) -> list[str]:
    """Returns the digests of the kept files that are intact; none to anybody but root."""
    try:
        names = sorted(name for name in os.listdir(home.upload) if is_sha256(name))
    except (FileNotFoundError, PermissionError):
        return []
    return [name for name in names if content(home, name) is not None]


def content(home: Home, sha256: str) -> bytes | None:
    """Returns the kept file with this digest, or None if there is none or it is damaged."""
    found = files.read(os.path.join(home.upload, sha256))
    return found if found is not None and files.digest_of(found) == sha256 else None


def clear(home: Home) -> None:
    """Removes all kept files."""
    files.remove_tree(home.upload)
