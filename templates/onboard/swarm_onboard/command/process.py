"""How a node that moves a robot ends: with status 0 by a signal, else so that systemd restarts it."""

from __future__ import annotations

import os
import signal
from concurrent import futures
from concurrent.futures import Future
from types import FrameType
from typing import Callable

from swarm_onboard.common.systemd import REJOINS

_LOOK_EVERY = 1.0  # s between two looks whether the master knows the node
_MISSES = 2
_NEW_MASTER = "the ROS master was restarted: this node ends, so that a new one joins it"
_SHUT_DOWN = "ROS has failed in this process: a new one is to replace it"


class TerminatedError(BaseException):
    """A signal ends the node. Not an Exception, so that no library catches it."""


class UnregisteredError(Exception):
    """The node is no longer part of the graph: why, as text for people, and the exit code."""

    def __init__(self, why: str, code: int = os.EX_TEMPFAIL) -> None:
        super().__init__(why)
        self.code = code


def end_on_signals() -> None:
    """Raises ``TerminatedError`` in the main thread at the first SIGTERM, SIGINT or SIGHUP."""
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, _terminate)


def watch(loop: Future[None], forgotten: Callable[[], bool]) -> None:
    """Waits for the end of the loop and raises its exception.

    Raises ``UnregisteredError`` if it ends without one, or if the master twice does not know the node.
    """
    misses = 0
    while not futures.wait([loop], _LOOK_EVERY).done:
        misses = misses + 1 if forgotten() else 0
        if misses == _MISSES:
            raise UnregisteredError(_NEW_MASTER, REJOINS)
    loop.result()
    raise UnregisteredError(_SHUT_DOWN)


def _terminate(number: int, _frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)
    raise TerminatedError
