"""Where a release shows outside its folder: links through ``current``, and blocks in files of others.

A block begins with the newline before its first marker, so that a file without a final newline gets one with
the block and loses it with the block.

What belongs to a swarm is known by itself, without a record: a link by where it leads, a block by its
markers. So whatever an interrupted deploy left behind is found and put right by the next.
"""

from __future__ import annotations

import os
from contextlib import suppress

from . import files
from .errors import FailedError, RefusedError
from .manifest import WITH_LINKS, Manifest
from .paths import BLOCK_FILES, LINK_FOLDERS, OF_PROGRAMS, READERS, ROOT
from .release_store import Home

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Iterable, Iterator

    from .messages import BlockDrift, LinkDrift


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


_UNITS = "/etc/systemd/system"
_AT_BOOT = _UNITS + "/multi-user.target.wants"
_KINDS = (".service", ".target", ".timer", ".socket", ".path")


def absent(home: Home) -> list[str]:
    """Returns the folders and files of programs that this host does not have."""
    return [place for place in OF_PROGRAMS if not os.path.exists(home.outside(place))]


def daemons_of(paths: Iterable[str]) -> list[str]:
    """Returns the daemons that read one of these files."""
    known = list(paths)
    return [name for name, folder in READERS.items() if any(path.startswith(folder) for path in known)]


def enabled(manifest: Manifest) -> list[str]:
    """Returns the units of a release that the host starts when it boots."""
    return [os.path.basename(path) for path in manifest.links if os.path.dirname(path) == _AT_BOOT]


def _our_links(home: Home) -> Iterator[str]:
    """Yields every link on the host into this swarm's current release."""
    ours = home.through_current("")
    for folder in LINK_FOLDERS:
        for path in _entries(home, folder):
            if (files.pointed(home.outside(path)) or "").startswith(ours):
                yield path


def _entries(home: Home, folder: str, *, deep: bool = True) -> Iterator[str]:
    try:
        names = sorted(os.listdir(home.outside(folder)))
    except (FileNotFoundError, NotADirectoryError):
        return
    for name in names:
        path = f"{folder}/{name}"
        yield path
        if deep and name.endswith(WITH_LINKS) and not os.path.islink(home.outside(path)):
            yield from _entries(home, path)


def foreign_units(home: Home, known: Iterable[str]) -> list[str]:
    """Returns the units that are named as those of the swarm, are not ``known``, and are of no swarm."""
    names = (os.path.basename(path) for path in _entries(home, _UNITS, deep=False))
    return [
        name
        for name in names
        if name.startswith(f"swarm-{home.swarm}.")
        and name.endswith(_KINDS)
        and name not in known
        and not (files.pointed(home.outside(f"{_UNITS}/{name}")) or "").startswith(ROOT + "/")
    ]


def _link_state(home: Home, path: str, source: str) -> LinkDrift | None:
    place = home.outside(path)
    target = files.pointed(place)
    if target == home.through_current(source):
        return None
    if not os.path.lexists(place):
        return "missing"
    ours = target is not None and target.startswith(home.through_current(""))
    return "changed" if ours else "foreign"


def link_deviations(home: Home, wanted: dict[str, str]) -> dict[str, LinkDrift]:
    """Returns ``missing``, ``changed``, ``foreign`` (in the way, not ours) or ``extra``, by path."""
    nowhere = absent(home)
    found: dict[str, LinkDrift] = {}
    for path, source in wanted.items():
        state = None if os.path.dirname(path) in nowhere else _link_state(home, path, source)
        if state:
            found[path] = state
    found.update((path, "extra") for path in _our_links(home) if path not in wanted)
    return found


def block_texts(home: Home) -> dict[str, bytes | None]:
    """Returns the text of our block in each file that may have one."""
    contents = {path: files.read(home.outside(path)) or b"" for path in BLOCK_FILES}
    return {path: text_in(content, home.swarm) for path, content in contents.items()}


def block_deviations(home: Home, digest: str | None, manifest: Manifest) -> dict[str, BlockDrift]:
    """Returns ``missing``, ``changed``, ``broken`` (markers lost) or ``extra``, by path."""
    found: dict[str, BlockDrift] = {}
    for path, wanted in _wanted_blocks(home, digest, manifest):
        try:
            present = text_in(files.read(home.outside(path)) or b"", home.swarm)
        except RefusedError:
            found[path] = "broken"
            continue
        if present != wanted:
            found[path] = "extra" if wanted is None else "missing" if present is None else "changed"
    return found


def _wanted_blocks(home: Home, digest: str | None, manifest: Manifest) -> Iterator[tuple[str, bytes | None]]:
    nowhere = absent(home)
    for path in BLOCK_FILES:
        if path in manifest.blocks and digest is not None and path not in nowhere:
            text = files.read(f"{home.release(digest)}/{manifest.blocks[path]}") or b""
            yield path, text if not text or text.endswith(b"\n") else text + b"\n"
        else:
            yield path, None


def check(home: Home, manifest: Manifest) -> None:
    """Checks that the paths of links are free or ours, and that blocks are intact.

    Raises ``RefusedError``.
    """
    for path, state in link_deviations(home, manifest.links).items():
        if state == "foreign":
            raise RefusedError(
                f"{path} exists and does not belong to swarm {home.swarm}",
                "move it away, or rename the swarm",
            )
    block_texts(home)


def put_links(home: Home, manifest: Manifest) -> list[str]:
    """Makes the links those of ``manifest``. Returns the paths that changed. Raises ``FailedError``."""
    deviations = link_deviations(home, manifest.links)
    for path, state in deviations.items():
        place = home.outside(path)
        folder = os.path.dirname(place)
        if state == "foreign":
            raise FailedError(f"{path} appeared and does not belong to swarm {home.swarm}")
        if state == "extra":
            files.remove(place)
            files.sync(folder)
            if folder.endswith(WITH_LINKS) and os.path.dirname(path) not in LINK_FOLDERS:
                with suppress(OSError):
                    os.rmdir(folder)
        else:
            _make_folders(home, os.path.dirname(path))
            files.point(place, home.through_current(manifest.links[path]))
    return list(deviations)


def _make_folders(home: Home, folder: str) -> None:
    """Makes a folder of the system with those above it, and notes first which of them were missing."""
    missing: list[str] = []
    while not os.path.isdir(home.outside(folder)):
        missing.insert(0, folder)
        folder = os.path.dirname(folder)
    if missing:
        noted = (files.read(home.folders_file) or b"").decode("utf-8").split("\n")
        files.replace(home.folders_file, "\n".join(dict.fromkeys([*filter(None, noted), *missing])).encode())
        os.makedirs(home.outside(missing[-1]), 0o755, exist_ok=True)


def remove_folders(home: Home) -> None:
    """Removes the folders of the system that were made for links, where nothing else is in them now."""
    for folder in reversed((files.read(home.folders_file) or b"").decode("utf-8").split("\n")):
        if folder.startswith(LINK_FOLDERS) or any(one.startswith(f"{folder}/") for one in LINK_FOLDERS):
            with suppress(OSError):
                os.rmdir(home.outside(folder))


def put_blocks(home: Home, digest: str | None, manifest: Manifest) -> list[str]:
    """Writes the blocks of the release. Returns the paths that changed."""
    changed = []
    for path, text in _wanted_blocks(home, digest, manifest):
        place = os.path.realpath(home.outside(path))
        original = files.read(place)
        before = original or b""
        after = without(before, home.swarm) if text is None else having(before, home.swarm, text)
        if after != before:
            files.replace(place, after, None if original is None else os.stat(place))
            changed.append(path)
    return changed
