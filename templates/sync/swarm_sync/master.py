"""One master as this node sees it over the network."""

from __future__ import annotations

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

    async def look(self, wanted: Callable[[Graph], frozenset[str]]) -> Graph:
        """The graph now, with the URIs of the nodes ``wanted`` of it; PeerError when it is not to be had."""
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
        """Have the master do all ``calls``, in their order."""
        if not calls:
            return []
        reply = await rpc.exchange(self._uri, calls, CALL_SECONDS, self._hosts)
        return await rpc.answers(reply, len(calls))
