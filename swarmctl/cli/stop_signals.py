"""Signals that end a program, while robots have to be stopped first."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any


def as_interrupt() -> AbstractContextManager[None]:
    """Makes SIGTERM and SIGHUP, of a terminal that closes, a KeyboardInterrupt within the block."""
    return _handled(signal.default_int_handler, signal.SIGTERM, signal.SIGHUP)


def ignored() -> AbstractContextManager[None]:
    """Ignores these and Ctrl-C within the block."""
    return _handled(signal.SIG_IGN, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def _handled(handler: Any, *numbers: signal.Signals) -> Iterator[None]:
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, one in before.items():
            signal.signal(number, one)
