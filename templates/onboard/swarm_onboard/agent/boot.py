"""The boot of the host: its identity, and its clock, which no change of the date moves."""

from __future__ import annotations

import time

from . import files
from .release_store import Home

_BOOT_ID = "/proc/sys/kernel/random/boot_id"


def identity(home: Home) -> str:
    """Returns the identity of this boot of the kernel (random(4))."""
    content = files.read(home.outside(_BOOT_ID)) or files.read(_BOOT_ID) or b""
    return content.decode("ascii", "replace").strip()


def now() -> float:
    """Returns s since the boot (CLOCK_BOOTTIME of clock_gettime(2))."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)
