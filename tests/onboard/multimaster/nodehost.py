"""Fake nodes of one island, each with a real slave API; reads one command a line; JSON in and out."""

from __future__ import annotations

import json
import sys
import threading
import xmlrpc.client
from socketserver import ThreadingMixIn
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

KIND = "std_msgs/String"


class _Handler(SimpleXMLRPCRequestHandler):
    rpc_paths = ("/", "/RPC2")


class _Server(ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True


class FakeNode:
    """A node with a slave API at a port of its own."""

    def __init__(self, address: str, ended: list[str], name: str) -> None:
        self._server = _Server((address, 0), _Handler, logRequests=False, allow_none=True)
        self.uri = f"http://{address}:{self._server.server_address[1]}/"
        self._server.register_function(lambda *_: [1, "", 0], "publisherUpdate")
        self._server.register_function(lambda *_: [1, "", 4711], "getPid")
        self._server.register_function(
            lambda *_: ended.append(f"{name} {self.uri}") or [1, "", 0], "shutdown"
        )
        threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True).start()

    def end(self) -> None:
        self._server.shutdown()
        self._server.server_close()


class NodeHost:
    def __init__(self, address: str, master: str) -> None:
        self._address = address
        self._master = xmlrpc.client.ServerProxy(master)
        self._nodes: dict[str, FakeNode] = {}
        self._ended: list[str] = []

    def start(self, name: str, publishes: list[str], subscribes: list[str]) -> str:
        """Start or restart a node; returns its URI."""
        if name in self._nodes:
            self._nodes[name].end()
        node = self._nodes[name] = FakeNode(self._address, self._ended, name)
        for topic in publishes:
            self._master.registerPublisher(name, topic, KIND, node.uri)
        for topic in subscribes:
            self._master.registerSubscriber(name, topic, KIND, node.uri)
        return node.uri

    def add(self, name: str, topic: str) -> None:
        self._master.registerPublisher(name, topic, KIND, self._nodes[name].uri)

    def drop(self, name: str, topic: str) -> None:
        self._master.unregisterPublisher(name, topic, self._nodes[name].uri)

    def stop(self, name: str, publishes: list[str], subscribes: list[str]) -> None:
        for topic in publishes:
            self._master.unregisterPublisher(name, topic, self._nodes[name].uri)
        for topic in subscribes:
            self._master.unregisterSubscriber(name, topic, self._nodes[name].uri)
        self._nodes.pop(name).end()

    def die(self, name: str) -> None:
        """End the node without unregistering it."""
        self._nodes[name].end()

    def forget(self) -> None:
        """End all nodes, as their units do when the master restarts."""
        for node in self._nodes.values():
            node.end()
        self._nodes.clear()
        self._master("close")()

    def shut_down(self) -> list[str]:
        """Name and URI of the nodes that a master has shut down since the last call."""
        ended, self._ended[:] = list(self._ended), []
        return ended


def main() -> None:
    host: Any = NodeHost(sys.argv[1], sys.argv[2])
    for line in sys.stdin:
        command, *arguments = json.loads(line)
        print(json.dumps(getattr(host, command)(*arguments)), flush=True)


if __name__ == "__main__":
    main()
