"""The host on which each node runs, as the master lists it.

A thread of its own looks it up, so nobody waits long.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import OrderedDict
from dataclasses import dataclass
from typing import Callable
from urllib.parse import urlsplit

_PATIENCE = 0.2  # s for which the very first command of a sender waits for the answer
_KNOWN_FOR = 10.0  # s until an answer is refreshed; it is valid until the next one comes
_UNKNOWN_FOR = 0.5  # s until a node that the master does not know is looked up again
_MOST = 64  # most nodes that are remembered, and that wait for a lookup


@dataclass
class _Place:
    """The known host of a node, and when to look it up again. ``pending``: a lookup is under way."""

    host: str | None
    due: float
    pending: bool = True


class NodeHosts:
    """``ask`` returns the URI of a node, None if there is none, and raises if the master does not answer."""

    def __init__(self, ask: Callable[[str], str], clock: Callable[[], float] = time.monotonic) -> None:
        self._ask = ask
        self._clock = clock
        self._places: OrderedDict[str, _Place] = OrderedDict()  # the latest lookup is last
        self._wanted: queue.Queue[str] = queue.Queue(_MOST)
        self._news = threading.Condition()
        threading.Thread(target=self._answer, name="node_hosts", daemon=True).start()

    def of(self, node: str) -> str | None:
        """Returns the host in the URI of ``node``; None while it is unknown."""
        with self._news:
            place = self._places.get(node)
            if place is not None:
                self._places.move_to_end(node)  # names that come once do not push out who goes on sending
                if self._clock() < place.due:
                    return place.host
            self._want(node, place.host if place is not None else None)
            if place is None:
                self._news.wait_for(lambda: self._settled(node), _PATIENCE)
            place = self._places.get(node)
            return place.host if place is not None else None

    def _want(self, node: str, host: str | None) -> None:
        place = self._places[node] = _Place(host, self._clock() + _KNOWN_FOR)
        if len(self._places) > _MOST:
            self._places.popitem(last=False)
        try:
            self._wanted.put_nowait(node)
        except queue.Full:  # the master hangs
            place.due, place.pending = self._clock() + _UNKNOWN_FOR, False

    def _settled(self, node: str) -> bool:
        place = self._places.get(node)
        return place is None or not place.pending

    def _answer(self) -> None:
        while True:
            node = self._wanted.get()
            try:
                uri = self._ask(node)
            except Exception:  # noqa: BLE001  a master that is away changes nothing, and nobody else asks
                self._learn(node, None, away=True)
            else:
                self._learn(node, _host_in(uri), away=False)

    def _learn(self, node: str, host: str | None, *, away: bool) -> None:
        with self._news:
            place = self._places.get(node)
            if place is not None:
                place.pending = False
                place.host = place.host if away else host
                place.due = self._clock() + (_KNOWN_FOR if place.host else _UNKNOWN_FOR)
            self._news.notify_all()


def _host_in(uri: str) -> str | None:
    """Returns the host as the node advertises it, in lower case; None if the text is not a URI."""
    try:
        return urlsplit(uri).hostname
    except ValueError:
        return None
