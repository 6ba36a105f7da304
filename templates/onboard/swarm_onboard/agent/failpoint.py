"""Faults on demand, for the tests: ``SWARM_FAILPOINT=after:STEP`` dies, ``error:STEP`` fills the disk."""

from __future__ import annotations

import errno
import os

DIED = 137


def passed(step: str) -> None:
    """Marks ``step`` as done. Raises ``OSError`` where a test wants one."""
    wanted = os.environ.get("SWARM_FAILPOINT", "").split(",")
    if "after:" + step in wanted:
        os._exit(DIED)
    if "error:" + step in wanted:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
