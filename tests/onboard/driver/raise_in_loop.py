"""Imported by a driver at its start: at SIGUSR1 an exception is raised in the loop that drives.

It stands in for a fault in the driver's code, which nothing else brings about from outside.
"""

from __future__ import annotations

import ctypes
import signal
import threading
from types import FrameType


class InjectedError(Exception):
    """Raised in the loop."""


def _raise(_number: int, _frame: FrameType | None) -> None:
    for thread in threading.enumerate():
        if thread.name.startswith("loop"):
            # https://docs.python.org/3/c-api/init.html#c.PyThreadState_SetAsyncExc
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(thread.ident or 0), ctypes.py_object(InjectedError)
            )


signal.signal(signal.SIGUSR1, _raise)
