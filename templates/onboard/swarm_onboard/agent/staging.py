"""From an uploaded archive to a complete release under its own name, or to nothing at all."""

from __future__ import annotations

import io
import os
import tarfile
import zlib
from contextlib import suppress

from . import disk, files
from .errors import RefusedError
from .failpoint import passed
from .manifest import NAME, Manifest, parse
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable

    Kept = Callable[[str], bytes | None]  # the content with a SHA-256, if the host has it

_LONGEST_MANIFEST = 4 << 20
_MARGIN = 1 << 20  # bytes for state, links and blocks
_BLOCK = 4096
# Every file of every release carries this date: systemd takes a unit whose date changes for one that changed.
_DATE = 946684800  # 2000-01-01 00:00 UTC


def _nothing(_sha256: str) -> bytes | None:
    return None


def unpack(payload: bytes, digest: str, kept: Kept = _nothing) -> tuple[Manifest, bytes, dict[str, bytes]]:
    """Returns the manifest, its bytes, and the files: exactly those in the manifest.

    Files that the payload leaves out are ``kept`` on the host. Raises ``RefusedError``.
    """
    try:
        with tarfile.open(fileobj=io.BytesIO(payload), mode="r|gz") as archive:
            return _unpack(archive, digest, kept)
    except (tarfile.TarError, EOFError, OSError, zlib.error) as error:
        raise RefusedError(
            f"the uploaded archive is damaged: {error}", "run the same command again"
        ) from error


def _unpack(archive: tarfile.TarFile, digest: str, kept: Kept) -> tuple[Manifest, bytes, dict[str, bytes]]:
    members = iter(archive)
    first = next(members, None)
    if first is None or first.name != NAME or not first.isreg() or first.size > _LONGEST_MANIFEST:
        raise RefusedError("the uploaded archive does not begin with its manifest")
    content = _content(archive, first)
    manifest = parse(content, digest)
    found: dict[str, bytes] = {}
    for member in members:
        entry = manifest.files.get(member.name)
        if entry is None or member.name in found or not member.isreg() or member.size != entry.size:
            raise RefusedError(f"the uploaded archive contains {member.name!r}, which its manifest does not")
        found[member.name] = _content(archive, member)
        if files.digest_of(found[member.name]) != entry.sha256:
            raise RefusedError(f"{member.name} was damaged on its way", "run the same command again")
    missing = []
    for path in sorted(set(manifest.files) - set(found)):
        known = kept(manifest.files[path].sha256)
        if known is None:
            missing.append(path)
        else:
            found[path] = known
    if missing:
        raise RefusedError(
            "the uploaded archive lacks {}".format(", ".join(missing)), "run the same command again"
        )
    return manifest, content, found


def complete(received: bytes, digest: str, longest: int) -> tuple[Manifest, dict[str, bytes]]:
    """Returns the manifest and, by SHA-256, the complete files in the first bytes of an archive.

    At most ``longest`` bytes are unpacked. Raises ``RefusedError`` without a complete manifest.
    """
    found: dict[str, bytes] = {}
    manifest: Manifest | None = None
    wanted: set[str] = set()
    with suppress(tarfile.TarError, OSError, zlib.error):
        plain = zlib.decompressobj(31).decompress(received, longest)
        with tarfile.open(fileobj=io.BytesIO(plain), mode="r:") as archive:
            for member in archive:
                content = _content(archive, member)
                if manifest is None:
                    manifest = parse(content, digest)
                    wanted = {entry.sha256 for entry in manifest.files.values()}
                elif (sha256 := files.digest_of(content)) in wanted:
                    found[sha256] = content
    if manifest is None:
        raise RefusedError("the upload ended in its manifest")
    return manifest, found


def _content(archive: tarfile.TarFile, member: tarfile.TarInfo) -> bytes:
    stream = archive.extractfile(member)
    return b"" if stream is None else stream.read()


def check_space(home: Home, manifest: Manifest) -> None:
    """Checks, before anything is written, that the disk is writable and has space.

    Raises ``RefusedError``.
    """
    space, place = os.statvfs(home.path), disk.file_system(home.path)
    wanted = _MARGIN + sum(entry.size + _BLOCK for entry in manifest.files.values())
    free = disk.free(home.path)
    if free < wanted:
        raise RefusedError(
            f"the disk is full: {free // 1024} KiB free in {place}, {wanted // 1024} KiB needed",
            f"free {(wanted - free) // 1024 + 1} KiB in {place}",
        )
    if space.f_files and space.f_favail < 2 * len(manifest.files) + 64:
        raise RefusedError(*disk.no_inodes(place))


def stage(home: Home, txid: str, manifest: Manifest, content: bytes, found: dict[str, bytes]) -> str:
    """Writes the release to a folder of its own and syncs it. Returns that folder."""
    folder = os.path.join(home.staging, txid)
    os.mkdir(folder, 0o755)
    for path, entry in manifest.files.items():
        place = os.path.join(folder, path)
        os.makedirs(os.path.dirname(place), 0o755, exist_ok=True)
        files.write_new(place, found[path], entry.mode)
        os.utime(place, (_DATE, _DATE))
    files.write_new(os.path.join(folder, NAME), content, 0o644)
    passed("stage")
    files.sync_disk(folder)
    passed("sync")
    return folder


def verify(folder: str, manifest: Manifest) -> None:
    """Reads every file back and compares it with the manifest. Raises ``RefusedError``."""
    for path, entry in manifest.files.items():
        if files.digest_of(files.read(os.path.join(folder, path)) or b"") != entry.sha256:
            raise RefusedError(f"{path} did not reach the disk as it was sent", "the disk may be failing")
    passed("verify")


def publish(home: Home, folder: str, digest: str, manifest: Manifest) -> None:
    """Gives the staged folder its name. A damaged release of that name is repaired file by file."""
    release = home.release(digest)
    if os.path.isdir(release):
        _repair(home, folder, digest, manifest)
        files.remove_tree(folder)
    else:
        os.rename(folder, release)
        files.sync(os.path.dirname(release))
    passed("publish")


def _repair(home: Home, folder: str, digest: str, manifest: Manifest) -> None:
    release = home.release(digest)
    for path, state in home.deviations(digest, manifest).items():
        place = os.path.join(release, path)
        if state == "extra":
            files.remove(place)
        else:
            os.makedirs(os.path.dirname(place), 0o755, exist_ok=True)
            os.rename(os.path.join(folder, path), place)
        files.sync(os.path.dirname(place))
    os.rename(os.path.join(folder, NAME), os.path.join(release, NAME))
    files.sync(release)
