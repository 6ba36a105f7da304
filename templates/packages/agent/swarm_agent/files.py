"""Files that survive a power cut: written beside, synced, renamed, and their folder synced too."""

from __future__ import annotations

import hashlib
import json
import os
from typing import Any, Iterator


def sync(path: str) -> None:
    """Writes a file, or the names in a folder, through to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
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
    return hashlib.sha256(content).hexdigest()


def write_new(path: str, content: bytes, mode: int) -> None:
    """Writes a file that must not exist yet."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
    with os.fdopen(descriptor, "wb") as file:
        os.fchmod(descriptor, mode)
        file.write(content)


def replace(path: str, content: bytes, like: os.stat_result | None = None, mode: int = 0o644) -> None:
    """Writes ``content`` to ``path`` atomically; owner and mode as in ``like``, else root's and ``mode``."""
    draft = "{}/.{}.swarm-new".format(*os.path.split(path))
    remove(draft)
    write_new(draft, content, like.st_mode & 0o7777 if like else mode)
    if like and (like.st_uid, like.st_gid) != (os.geteuid(), os.getegid()):
        os.chown(draft, like.st_uid, like.st_gid)
    sync(draft)
    os.rename(draft, path)
    sync(os.path.dirname(path))


def point(path: str, target: str) -> None:
    """Makes ``path`` a symbolic link to ``target``, atomically."""
    draft = "{}/.{}.swarm-new".format(*os.path.split(path))
    remove(draft)
    os.symlink(target, draft)
    os.rename(draft, path)
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


def read_json(path: str) -> Any:
    """Returns the JSON value at ``path``, or None if there is no file or it is damaged."""
    content = read(path)
    try:
        return None if content is None else json.loads(content.decode("utf-8"))
    except ValueError:
        return None


def write_json(path: str, value: Any) -> None:
    """Writes ``value`` atomically as JSON. Raises ``OSError``."""
    replace(path, (json.dumps(value, sort_keys=True, indent=1) + "\n").encode("utf-8"))


def walk(root: str) -> Iterator[str]:
    """Yields every file and link below ``root``, relative to it."""
    for folder, folders, names in os.walk(root):
        links = [name for name in folders if os.path.islink(os.path.join(folder, name))]
        for name in sorted(names + links):
            yield os.path.relpath(os.path.join(folder, name), root)
