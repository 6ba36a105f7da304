"""A process whose mounts nobody else sees, and which takes them with it when it ends, however it ends."""

from __future__ import annotations

import ctypes
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.power import disk, tracer

_NEW_MOUNTS = 0x00020000  # CLONE_NEWNS


def missing() -> str:
    """Returns what this machine lacks for cuts; empty if nothing."""
    if os.geteuid() != 0:
        return "root"
    if os.uname().machine != tracer.MACHINE:
        return f"an {tracer.MACHINE} processor"
    if not Path("/dev/loop-control").exists():
        return "/dev/loop-control"
    return disk.missing("ext4")


@contextmanager
def folder() -> Iterator[Path]:
    """Moves the process to mounts of its own. Yields a folder in memory, which nobody else sees."""
    if ctypes.CDLL(None, use_errno=True).unshare(_NEW_MOUNTS) != 0:
        raise OSError(ctypes.get_errno(), "unshare")
    subprocess.run(["mount", "--make-rprivate", "/"], check=True)
    place = Path("/mnt")
    subprocess.run(["mount", "-t", "tmpfs", "power-cuts", str(place)], check=True)
    try:
        yield place
    finally:
        os.chdir("/")
        subprocess.run(["umount", "--recursive", str(place)], check=True)
