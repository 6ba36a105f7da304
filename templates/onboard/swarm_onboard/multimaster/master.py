"""Client of one master: queries its graph and makes calls."""

from __future__ import annotations

import asyncio
from typing import Callable, Collection, Sequence

from swarm_onboard.common.xmlrpc import Names
from swarm_onboard.multimaster import graph, rpc
from swarm_onboard.multimaster.graph import Graph
from swarm_onboard.multimaster.rpc import Answer, Call

CALL_SECONDS = 2.0
_ROUNDS = 3  # of lookups of nodes that appeared meanwhile


class Master:
    """Polls a graph; an unchanged reply is not parsed again."""

    def __init__(self, uri: str, me: str, topics: Collection[str] | None = None) -> None:
        self._uri, self._me, self._topics = uri, me, topics
        self._names: tuple[str, ...] = (me,)
        self._hosts = Names()
        self._reply = b""
        self._graph: Graph | None = None
        self._at_work: asyncio.Future[list[Answer]] | None = None

    async def look(self, wanted: Callable[[Graph], frozenset[str]]) -> Graph:
        """The graph now, with the URIs of the nodes ``wanted`` of it. Raises PeerError."""
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
        """Sends all ``calls``, in order; returns the answers.

        The request continues when the caller is cancelled, and the next one waits for it: otherwise
        ``unregister_all`` could be overtaken by a registration that it should remove.
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
        """Waits until no earlier calls are in progress (they time out)."""
        if self._at_work is not None and not self._at_work.done():
            await asyncio.wait([self._at_work])
