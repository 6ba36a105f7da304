"""One master as this node sees it over the network."""

from __future__ import annotations

import asyncio
from typing import Callable, Collection, Sequence

from swarm_sync import graph, rpc
from swarm_sync.graph import Graph
from swarm_sync.rpc import Answer, Call

CALL_SECONDS = 2.0
_ROUNDS = 3  # of looking up who turned up meanwhile


class Master:
    """Looks at a graph again and again; what has not changed is not read again."""

    def __init__(self, uri: str, me: str, topics: Collection[str] | None = None) -> None:
        self._uri, self._me, self._topics = uri, me, topics
        self._names: tuple[str, ...] = (me,)
        self._hosts = rpc.Names()
        self._reply = b""
        self._graph: Graph | None = None
        self._at_work: asyncio.Future[list[Answer]] | None = None

    async def look(self, wanted: Callable[[Graph], frozenset[str]]) -> Graph:
        """The graph now, with the URIs of the nodes ``wanted`` of it; PeerError when it is not to be had."""
        await self._rest()
        found = await self._look(self._names)
        for _ in range(_ROUNDS):
            names = tuple(sorted(wanted(found) | {self._me}))
            if names == self._names:
                break
            found = await self._look(names)
        return found

    async def _look(self, names: tuple[str, ...]) -> Graph:
        questions = graph.questions(self._me, names)
        reply = await rpc.exchange(self._uri, questions, CALL_SECONDS, self._hosts)
        if self._graph is None or names != self._names or reply != self._reply:
            answers = await rpc.answers(reply, len(questions))
            self._graph = graph.read(answers, self._me, names, self._topics)
            self._names, self._reply = names, reply
        return self._graph

    async def do(self, calls: Sequence[Call]) -> list[Answer]:
        """Have the master do all ``calls``, in their order.

        It goes on with them when the caller is cancelled, so whatever comes next waits until they are done:
        a farewell in between would be followed by what it is to take back.
        """
        if not calls:
            return []
        await self._rest()
        self._at_work = asyncio.ensure_future(self._do(calls))
        return await asyncio.shield(self._at_work)

    async def _do(self, calls: Sequence[Call]) -> list[Answer]:
        reply = await rpc.exchange(self._uri, calls, CALL_SECONDS, self._hosts)
        return await rpc.answers(reply, len(calls))

    async def _rest(self) -> None:
        """Until nothing that the master was told is under way, or was for too long."""
        if self._at_work is not None and not self._at_work.done():
            await asyncio.wait([self._at_work])
