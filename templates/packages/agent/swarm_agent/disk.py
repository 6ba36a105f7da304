"""Full disks: which file system is full, and what is free on it."""

from __future__ import annotations

import contextlib
import errno
import os
from typing import Iterator

from .errors import FailedError

_FULL = (errno.ENOSPC, errno.EDQUOT)


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


def full(path: str, what: str) -> FailedError:
    """Returns the error of ``what``, which failed since the file system of ``path`` is full."""
    place = file_system(path)
    return FailedError(
        f"{what} failed: the disk is full: {free(path) // 1024} KiB free in {place}",
        f"free space in {place}, then run the same again",
    )


@contextlib.contextmanager
def named_if_full(path: str, what: str) -> Iterator[None]:
    """Writes of the block are below ``path``. Raises ``FailedError`` where its file system is full."""
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            raise full(path, what) from error
        raise
