"""What people have edited in the current release and in our blocks, and a copy before it is replaced."""

from __future__ import annotations

import os

from . import files, system_links
from .errors import RefusedError
from .manifest import NAME, Manifest
from .named_tuple import NamedTuple
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator, Literal

LONGEST = 16 << 20  # bytes of a file that is kept
LONGEST_TEXT = 64 << 10  # bytes of a file that is sent to the operator
LONGEST_TEXTS = 256 << 10  # bytes of all of them
MOST = 100  # kept files
_CACHE = "__pycache__"
_PRIVATE = b"PRIVATE KEY-----"


class Drift(NamedTuple):
    """Deviations from the manifest, by path."""

    files: dict[str, Literal["changed", "missing", "extra", "damaged"]]
    links: dict[str, Literal["changed", "missing", "extra", "foreign"]]
    blocks: dict[str, Literal["changed", "missing", "extra", "broken"]]


def drift(home: Home, digest: str, manifest: Manifest) -> Drift:
    """Returns how the host differs from the release."""
    return Drift(
        home.deviations(digest, manifest),
        system_links.link_deviations(home, manifest.links),
        system_links.block_deviations(home, digest, manifest),
    )


def found(home: Home, digest: str, manifest: Manifest, known: Drift) -> tuple[dict[str, str], dict[str, str]]:
    """Returns the SHA-256 of each edited or added file of the release, and of each edited block, by path; and
    the texts of the edited ones, as many as fit. What people have added is theirs, and is not sent."""
    digests: dict[str, str] = {}
    texts: dict[str, str] = {}
    left = LONGEST_TEXTS
    for path, content in _edited(home, digest, manifest, known):
        digests[path] = files.digest_of(content)
        is_ours = path in manifest.files or path in manifest.blocks
        text = _text(os.path.join(home.release(digest), path), content) if is_ours else None
        if text is not None and len(content) <= left:
            texts[path] = text
            left -= len(content)
    return digests, texts


def _text(place: str, content: bytes) -> str | None:
    """Returns the content as text; None for a link, a long or binary file, and one with a private key."""
    if len(content) > LONGEST_TEXT or _PRIVATE in content or os.path.islink(place):
        return None
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return None


def keep(home: Home, digest: str, manifest: Manifest) -> list[str]:
    """Copies edited files and blocks to ``state/edits``, for root alone. Returns the new copies.

    Equal edits are kept once; the oldest beyond ``MOST`` are removed. Raises ``RefusedError`` for a file
    that is too large, and ``OSError``.
    """
    copies = []
    for path, content in _edited(home, digest, manifest, drift(home, digest, manifest)):
        if len(content) > LONGEST:
            raise RefusedError(
                f"{path} was edited, and at {len(content) >> 20} MiB it is too large to keep a copy",
                f"move {home.release(digest)}/{path} away",
            )
        folder = os.path.join(home.edits, files.digest_of(content)[:12])
        copy = os.path.join(folder, os.path.basename(path))
        if not os.path.exists(copy):
            os.makedirs(home.edits, 0o700, exist_ok=True)
            os.makedirs(folder, 0o700, exist_ok=True)
            files.replace(copy, content, mode=0o600)
            copies.append(copy)
    if copies:
        _forget_oldest(home)
    return copies


def _edited(home: Home, digest: str, manifest: Manifest, known: Drift) -> Iterator[tuple[str, bytes]]:
    for path, state in known.files.items():
        if state not in ("changed", "extra") or path == NAME or _CACHE in path.split("/"):
            continue
        content = _content(os.path.join(home.release(digest), path))
        entry = manifest.files.get(path)
        if content is not None and (entry is None or files.digest_of(content) != entry.sha256):
            yield path, content
    for path, change in known.blocks.items():
        if change == "changed":
            text = system_links.text_in(files.read(home.outside(path)) or b"", home.swarm)
            if text is not None:
                yield path, text


def _content(place: str) -> bytes | None:
    if os.path.islink(place):
        return f"a link to {os.readlink(place)}\n".encode("utf-8", "surrogateescape")
    return files.read(place)


def _forget_oldest(home: Home) -> None:
    copies = [os.path.join(home.edits, path) for path in files.walk(home.edits)]
    for copy in sorted(copies, key=os.path.getmtime)[:-MOST]:
        files.remove(copy)
        folder = os.path.dirname(copy)
        if not os.listdir(folder):
            os.rmdir(folder)
