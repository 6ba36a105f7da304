"""Queues between the operator's process and its workers."""

from __future__ import annotations

import queue
from dataclasses import dataclass
from typing import Protocol


class Line(Protocol):
    """A queue that several processes share. It can be pickled."""

    def put(self, item: bytes) -> None:
        """Add an item."""
        ...

    def get(self, timeout: float) -> bytes | None:
        """Return the oldest item, or None if there is none for ``timeout`` s."""
        ...

    def close(self) -> None:
        """Free it, once nobody uses it any more."""
        ...


class Queue(Protocol):
    """What the queues of ``queue`` and of ``multiprocessing.Manager`` have in common."""

    def put(self, item: bytes) -> None:
        """Add an item."""

    def get(self, block: bool = True, timeout: float | None = None) -> bytes:
        """Return the oldest item. Raises ``queue.Empty``."""


@dataclass(frozen=True)
class QueueLine:
    """A queue of ``queue`` for threads, or one of ``multiprocessing.Manager`` for processes."""

    queue: Queue

    def put(self, item: bytes) -> None:
        """See ``Line``."""
        self.queue.put(item)

    def get(self, timeout: float) -> bytes | None:
        """See ``Line``."""
        try:
            return self.queue.get(timeout=timeout)
        except queue.Empty:
            return None

    def close(self) -> None:
        """See ``Line``."""
