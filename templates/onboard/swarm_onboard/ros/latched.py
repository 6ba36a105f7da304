"""Which commands are old: a latching publisher repeats its last message to whoever connects. Knows no ROS."""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import Collection

_MOST = 64  # nodes that are remembered


class Latched:
    """``present`` are the nodes that published before this one subscribed: their first message may be old."""

    def __init__(self, present: Collection[str]) -> None:
        self._connections: OrderedDict[str, object] = OrderedDict((node, None) for node in present)
        self._lock = threading.Lock()

    def repeats(self, node: str, connection: object) -> bool:
        """Returns True for the first message on a ``connection`` that is not the first one of ``node``.

        To be called for each message of a publisher that latches.
        """
        with self._lock:
            known = node in self._connections
            before = self._connections.pop(node, None)
            self._connections[node] = connection
            if len(self._connections) > _MOST:
                self._connections.popitem(last=False)
            return known and before is not connection
