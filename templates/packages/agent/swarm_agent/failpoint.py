"""Faults on demand, for the tests: ``SWARM_FAILPOINT=after:STEP`` dies, ``error:STEP`` fills the disk."""

from __future__ import annotations

import errno
import os

DIED = 137


def passed(step: str) -> None:
    """Say that ``step`` is done."""
    wanted = os.environ.get("SWARM_FAILPOINT", "").split(",")
    if "after:" + step in wanted:
        os._exit(DIED)
    if "error:" + step in wanted:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
