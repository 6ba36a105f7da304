"""Masters for tests: the registration rules of rosmaster 1.15 (registrations.py), in memory or over HTTP."""

from __future__ import annotations

import threading
import xmlrpc.client
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from xmlrpc.server import SimpleXMLRPCDispatcher, SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

ANY = "*"


@dataclass
class Node:
    """The registrations of a node."""

    uri: str
    publishes: set[str] = field(default_factory=set)
    subscribes: set[str] = field(default_factory=set)


class Rosmaster:
    """One master. ``shut_down`` lists the nodes that a real one would shut down: name and replaced URI."""

    def __init__(self) -> None:
        self.nodes: dict[str, Node] = {}
        self.types: dict[str, str] = {}
        self.services: dict[str, str] = {}
        self.parameters: dict[str, Any] = {}
        self.shut_down: list[tuple[str, str]] = []
        self.updates: list[tuple[str, str]] = []  # subscriber and topic of each publisherUpdate

    def getPid(self, _caller: str) -> list[Any]:  # noqa: N802
        return [1, "", 4711]

    def registerPublisher(self, caller: str, topic: str, kind: str, uri: str) -> list[Any]:  # noqa: N802
        self._node(caller, uri).publishes.add(topic)
        if kind != ANY or topic not in self.types:
            self.types[topic] = kind
        return [1, "", self._update_subscribers(topic)]

    def unregisterPublisher(self, caller: str, topic: str, uri: str) -> list[Any]:  # noqa: N802
        gone = self._forget(caller, uri, topic, "publishes")
        if gone:
            self._update_subscribers(topic)
        return [1, "", gone]

    def registerSubscriber(self, caller: str, topic: str, kind: str, uri: str) -> list[Any]:  # noqa: N802
        self._node(caller, uri).subscribes.add(topic)
        if kind != ANY:
            self.types.setdefault(topic, kind)
        return [1, "", [node.uri for node in self.nodes.values() if topic in node.publishes]]

    def unregisterSubscriber(self, caller: str, topic: str, uri: str) -> list[Any]:  # noqa: N802
        return [1, "", self._forget(caller, uri, topic, "subscribes")]

    def registerService(self, caller: str, service: str, place: str, uri: str) -> list[Any]:  # noqa: N802
        self._node(caller, uri)
        self.services[service] = place
        return [1, "", 1]

    def lookupNode(self, _caller: str, name: str) -> list[Any]:  # noqa: N802
        return [1, "", self.nodes[name].uri] if name in self.nodes else [-1, f"unknown node [{name}]", ""]

    def getSystemState(self, _caller: str) -> list[Any]:  # noqa: N802
        return [1, "", [self._state("publishes"), self._state("subscribes"), []]]

    def getTopicTypes(self, _caller: str) -> list[Any]:  # noqa: N802
        return [1, "", [[topic, kind] for topic, kind in self.types.items()]]

    def getParam(self, _caller: str, key: str) -> list[Any]:  # noqa: N802
        return [1, "", self.parameters[key]] if key in self.parameters else [-1, f"[{key}] is not set", 0]

    def setParam(self, _caller: str, key: str, value: Any) -> list[Any]:  # noqa: N802
        self.parameters[key] = value
        return [1, "", 0]

    def deleteParam(self, _caller: str, key: str) -> list[Any]:  # noqa: N802
        return [1, "", 0] if self.parameters.pop(key, None) is not None else [-1, "not set", 0]

    def publishers(self) -> set[tuple[str, str, str]]:
        """Topic, node and URI of every publisher."""
        return {(topic, name, node.uri) for name, node in self.nodes.items() for topic in node.publishes}

    def subscribers(self) -> set[tuple[str, str, str]]:
        return {(topic, name, node.uri) for name, node in self.nodes.items() for topic in node.subscribes}

    def _node(self, name: str, uri: str) -> Node:
        known = self.nodes.get(name)
        if known and known.uri != uri:
            self.shut_down.append((name, known.uri))
            known = None
        if not known:
            self.nodes[name] = known = Node(uri)
        return known

    def _forget(self, name: str, uri: str, topic: str, what: str) -> int:
        node = self.nodes.get(name)
        if not node or node.uri != uri or topic not in getattr(node, what):
            return 0
        getattr(node, what).remove(topic)
        if not node.publishes | node.subscribes:
            del self.nodes[name]
        return 1

    def _update_subscribers(self, topic: str) -> list[str]:
        subscribers = [(name, node.uri) for name, node in self.nodes.items() if topic in node.subscribes]
        self.updates += [(name, topic) for name, _ in subscribers]
        return [uri for _, uri in subscribers]

    def _state(self, what: str) -> list[Any]:
        topics: dict[str, list[str]] = {}
        for name, node in self.nodes.items():
            for topic in sorted(getattr(node, what)):
                topics.setdefault(topic, []).append(name)
        return [[topic, names] for topic, names in topics.items()]


def reply(master: Rosmaster, calls: Sequence[Sequence[Any]]) -> bytes:
    """The response of ``master`` to one request with all ``calls``, as bytes."""
    dispatcher = SimpleXMLRPCDispatcher(allow_none=True)
    dispatcher.register_instance(master)
    dispatcher.register_multicall_functions()
    many = [{"methodName": method, "params": list(arguments)} for method, *arguments in calls]
    return dispatcher._marshaled_dispatch(xmlrpc.client.dumps((many,), "system.multicall").encode())


class _Handler(SimpleXMLRPCRequestHandler):
    rpc_paths = ("/", "/RPC2")


class _Server(SimpleXMLRPCServer):
    allow_reuse_address = True


@contextmanager
def served(master: Any, host: str = "127.0.0.1", port: int = 0) -> Iterator[str]:
    """Serve ``master`` over HTTP; yields its URI."""
    server = _Server((host, port), _Handler, logRequests=False, allow_none=True)
    server.register_instance(master)
    server.register_multicall_functions()
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield f"http://{host}:{server.server_address[1]}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
