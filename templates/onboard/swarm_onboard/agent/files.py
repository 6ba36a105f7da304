"""Files that survive a power cut: written beside, synced, renamed, and their folder synced too."""

from __future__ import annotations

import os
from contextlib import suppress

from . import json_text

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterator

try:
    from _sha256 import sha256  # type: ignore[import-not-found]
except ImportError:  # Python 3.12 and later
    from _sha2 import sha256  # type: ignore[import-not-found]

# hashlib loads OpenSSL, which takes longer than to hash a release without it; large contents are worth that.
_LARGE = 8 << 20  # bytes


def sync(path: str) -> None:
    """Writes a file, or the names in a folder, through to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_disk(folder: str) -> None:
    """Writes all of the file system that ``folder`` is on through to the disk.

    The disk is waited for once then, and not once for each file, which takes seconds on a memory card.
    """
    import ctypes  # noqa: PLC0415  (takes long to load, and few need it)

    library = ctypes.CDLL(None, use_errno=True)
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        if library.syncfs(descriptor) != 0:
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number), folder)
    finally:
        os.close(descriptor)


def read(path: str) -> bytes | None:
    """Returns the file's content, or None if there is no such file."""
    try:
        with open(path, "rb") as file:
            return file.read()
    except FileNotFoundError:
        return None


def digest_of(content: bytes) -> str:
    """Returns the SHA-256 of ``content`` in hexadecimal."""
    if len(content) >= _LARGE:
        import hashlib  # noqa: PLC0415  (see above)

        return hashlib.sha256(content).hexdigest()
    return str(sha256(content).hexdigest())


def write_new(path: str, content: bytes, mode: int) -> None:
    """Writes a file that must not exist yet."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
    with os.fdopen(descriptor, "wb") as file:
        os.fchmod(descriptor, mode)
        file.write(content)


def draft(path: str) -> str:
    """Returns the path of the file or link that ``replace`` and ``point`` make beside ``path``."""
    return "{}/.{}.swarm-new".format(*os.path.split(path))


def replace(
    path: str,
    content: bytes,
    like: os.stat_result | None = None,
    mode: int = 0o644,
    *,
    named: bool = True,
) -> None:
    """Writes ``content`` to ``path`` atomically; owner and mode as in ``like``, else root's and ``mode``.

    Without ``named`` the name is on the disk only once the folder is synced by somebody else.
    """
    new = draft(path)
    remove(new)
    write_new(new, content, like.st_mode & 0o7777 if like else mode)
    if like and (like.st_uid, like.st_gid) != (os.geteuid(), os.getegid()):
        os.chown(new, like.st_uid, like.st_gid)
    sync(new)
    os.rename(new, path)
    if named:
        sync(os.path.dirname(path))


def point(path: str, target: str) -> None:
    """Makes ``path`` a symbolic link to ``target``, atomically."""
    new = draft(path)
    remove(new)
    os.symlink(target, new)
    os.rename(new, path)
    sync(os.path.dirname(path))


def pointed(path: str) -> str | None:
    """Returns the target of the symbolic link at ``path``, or None if there is none."""
    try:
        return os.readlink(path)
    except OSError:
        return None


def remove(path: str) -> bool:
    """Removes a file or link. Returns whether there was one."""
    try:
        os.unlink(path)
    except FileNotFoundError:
        return False
    return True


def remove_tree(path: str) -> None:
    """Removes a folder with all that is in it, as far as that is possible. shutil takes long to load."""
    for folder, folders, names in os.walk(path, topdown=False):
        for name in names + folders:
            place = os.path.join(folder, name)
            with suppress(OSError):
                (os.unlink if name in names or os.path.islink(place) else os.rmdir)(place)
    with suppress(OSError):
        os.rmdir(path)


def read_json(path: str) -> Any:
    """Returns the JSON value at ``path``, or None if there is no file or it is damaged."""
    content = read(path)
    try:
        return None if content is None else json_text.loads(content.decode("utf-8"))
    except ValueError:
        return None


def write_json(path: str, value: Any) -> None:
    """Writes ``value`` atomically as JSON. Raises ``OSError``."""
    replace(path, (json_text.dumps(value, sort_keys=True) + "\n").encode("utf-8"))


def walk(root: str) -> Iterator[str]:
    """Yields every file and link below ``root``, relative to it."""
    for folder, folders, names in os.walk(root):
        links = [name for name in folders if os.path.islink(os.path.join(folder, name))]
        for name in sorted(names + links):
            yield os.path.relpath(os.path.join(folder, name), root)
