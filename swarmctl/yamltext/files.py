"""Reads the bytes of one file, bounded in size and time. Knows no project and no text."""

from __future__ import annotations

import errno
import os
import re
import select
import stat
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TypeAlias

MAX_BYTES = 4 << 20
"""Bytes of all files together. 10 000 robots are 2.5 MB; wide characters take four times the memory."""

MAX_NODES = 232_000
"""Keys, values, lists and mappings of all files together. 10 000 robots on 2 000 hosts are 230 000; with as
many that are all wrong, a check stays below 200 MB."""

MAX_DEPTH = 64
"""Nested lists and mappings. A spec needs seven. libyaml composes recursively, on its stack."""

MAX_REPEATED = 100_000
"""Values that aliases may add to those in the text: nine lists of nine aliases are 3 * 10^8."""

MAX_NUMBER = 100
"""Characters of a number. Python converts thousands of digits slowly, and no quantity needs them."""

MAX_FINDINGS = 1_000
"""Findings per pass over one spec. Each takes a kilobyte, and more are not readable."""

MAX_FIXABLE = 200_000
"""Characters of a file that fixes are computed for, token by token. Programs write larger ones."""

MAX_FILES = 1_000
"""Files of one spec, so that each robot of a large swarm may have its own."""

MAX_CHAIN = 16
"""Depth of nested includes."""

MAX_CODEC_BYTES = 64 << 10
"""Bytes of a robot type's Python class, which Python parses in 0.5 s and 100 MB at worst."""

MAX_CODECS_BYTES = 2 * MAX_CODEC_BYTES
"""Bytes of all Python classes of a spec together: some 3 000 lines."""

MAX_ENTRIES = 10_000
"""Names that are looked at in a folder of a spec."""

MAX_SECONDS = 60
"""Time that a pipe has to bring a whole spec."""


SourceTexts: TypeAlias = dict[str, str]


@dataclass
class LoadBudget:
    """What is left of the limits while the files of one spec are read, and their texts by file name."""

    bytes: int = MAX_BYTES
    nodes: int = MAX_NODES
    files: int = MAX_FILES
    codec_bytes: int = MAX_CODECS_BYTES
    texts: SourceTexts = field(default_factory=dict)


Read = Callable[[Path], bytes]

_STREAM = re.compile(r"/dev/(stdin|fd/[0-9]+)|/proc/self/fd/[0-9]+")
_KERNEL = ("/proc/", "/sys/")  # their files are regular ones, and show what the machine does


def content(path: Path, most: int = MAX_BYTES) -> bytes:
    """Returns the bytes of a regular file, at most one above ``most``. Raises OSError.

    Devices and pipes are not opened, which alone may block or reset a robot's board, except a pipe that the
    shell has opened: ``/dev/stdin`` and ``<(...)``.
    """
    if is_stream(path):
        return _once(path, most)
    if os.path.realpath(path).startswith(_KERNEL):
        raise OSError(errno.EINVAL, "files of /proc and /sys are no part of a spec")
    _check(path.stat().st_mode)
    with open(path, "rb", opener=_without_waiting) as file:
        _check(os.fstat(file.fileno()).st_mode)  # another file may have taken its place
        return file.read(most + 1)


@cache
def _once(path: Path, most: int) -> bytes:
    """Returns what a stream brings; it brings it once, and an excerpt for a finding asks again."""
    _check(path.stat().st_mode, piped=True)
    with open(path, "rb", opener=_without_waiting) as file:
        if stat.S_ISFIFO(os.fstat(file.fileno()).st_mode):
            return _from_pipe(file.fileno(), most)
        return file.read(most + 1)


def _without_waiting(path: str, flags: int) -> int:
    """Opens a file; a pipe without a writer, or a serial port, would hold up an ordinary ``open``."""
    return os.open(path, flags | os.O_NONBLOCK)


def is_stream(path: Path) -> bool:
    """True for the names under which a shell passes what it has opened itself."""
    return _STREAM.fullmatch(str(path)) is not None


def is_special(path: Path) -> bool:
    """True for a device, a pipe or a socket."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False  # reading it reports the error
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


def _check(mode: int, *, piped: bool = False) -> None:
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(mode) and not (piped and stat.S_ISFIFO(mode)):
        raise OSError(errno.EINVAL, "it is a device or a pipe, not a file")


def _from_pipe(descriptor: int, most: int) -> bytes:
    """Returns what comes until the other side closes the pipe. Raises TimeoutError if that takes too long."""
    found, ends = bytearray(), time.monotonic() + MAX_SECONDS
    ready = select.poll()
    ready.register(descriptor, select.POLLIN)
    while len(found) <= most:
        if not ready.poll(max(0.0, ends - time.monotonic()) * 1000):
            raise TimeoutError(errno.ETIMEDOUT, f"its other side did not close it within {MAX_SECONDS} s")
        piece = os.read(descriptor, most + 1 - len(found))
        if not piece:
            break
        found += piece
    return bytes(found)
