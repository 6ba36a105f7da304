"""Operators as hosts show them to each other: ``name@machine (process)``."""

from __future__ import annotations

import getpass
import os
import socket


def this_one() -> str:
    """Returns who runs this process."""
    return f"{getpass.getuser()}@{socket.gethostname()} ({os.getpid()})"


def ended_here(who: str) -> bool:
    """Returns True if ``who`` is this operator on this machine, in a run that has ended."""
    person, _, process = who.rpartition(" (")
    number = process.rstrip(")")
    if person != this_one().rpartition(" (")[0] or not number.isdecimal():
        return False
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False
