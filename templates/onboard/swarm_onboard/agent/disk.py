"""Full disks: which file system is full, of what, and what is free on it; a spare for the way back."""

from __future__ import annotations

import contextlib
import errno
import os

from . import files
from .errors import FailedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator

_FULL = (errno.ENOSPC, errno.EDQUOT)
_SPARE = 64 << 10  # bytes
_FEW = 64  # inodes: a write that failed may have freed some since


def file_system(path: str) -> str:
    """Returns the folder on which the file system of ``path`` is mounted."""
    place = os.path.realpath(path)
    while not os.path.ismount(place):
        place = os.path.dirname(place)
    return place


def free(path: str) -> int:
    """Returns how many bytes are free on the file system of ``path``."""
    space = os.statvfs(path)
    return space.f_bavail * space.f_frsize


def is_full(error: OSError) -> bool:
    """Returns True if a write failed since its file system is full."""
    return error.errno in _FULL


def no_inodes(path: str) -> tuple[str, str]:
    """Returns how many inodes the file system of ``path`` has left, as an error, and what helps."""
    place = file_system(path)
    left = os.statvfs(place).f_favail
    return f"the disk has no inodes left: {left} in {place}", f"remove files from {place}"


def lack(path: str) -> tuple[str, str]:
    """Returns what the full file system of ``path`` lacks, inodes or space, and what helps."""
    place = file_system(path)
    found = os.statvfs(place)
    if found.f_files and found.f_favail < _FEW:
        return no_inodes(place)
    return f"the disk is full: {free(place) // 1024} KiB free in {place}", f"free space in {place}"


def full(path: str, what: str) -> FailedError:
    """Returns the error of ``what``, which failed since the file system of ``path`` is full."""
    lacks, advice = lack(path)
    return FailedError(f"{what} failed: {lacks}", f"{advice}, then run the same again")


def hold_spare(path: str) -> None:
    """Holds some space and an inode at ``path``, to be free for the way back. Raises ``OSError``."""
    files.remove(path)
    files.write_new(path, bytes(_SPARE), 0o600)


@contextlib.contextmanager
def named_if_full(path: str, what: str) -> Iterator[None]:
    """Writes of the block are below ``path``. Raises ``FailedError`` where its file system is full."""
    try:
        yield
    except OSError as error:
        if is_full(error):
            raise full(path, what) from error
        raise
