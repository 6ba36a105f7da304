"""Operators as hosts show them to each other: ``name@machine (process)``."""

from __future__ import annotations

import getpass
import os
import socket


def this_one() -> str:
    """Returns who runs this process."""
    return f"{getpass.getuser()}@{socket.gethostname()} ({os.getpid()})"


def person(who: str) -> str:
    """Returns ``name@machine``: of a run that has ended, nobody needs the process."""
    return who.rpartition(" (")[0] or who


def ended_here(who: str) -> bool:
    """Returns True if ``who`` is this operator on this machine, in a run that has ended."""
    number = who.rpartition(" (")[2].rstrip(")")
    if person(who) != person(this_one()) or not number.isdecimal():
        return False
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False
