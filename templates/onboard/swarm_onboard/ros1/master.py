"""What a node of ROS 1 looks up at its master, each within two seconds."""

from __future__ import annotations

import os
import time
from http.client import HTTPConnection
from typing import Any, Sequence
from xmlrpc.client import MultiCall, ServerProxy, Transport

import rosgraph
import rospy

_ANSWERS_WITHIN = 2.0  # s
_LOOK_EVERY = 0.1  # s, for a parameter
_SUCCESS, _UNKNOWN_NODE = 1, -1  # of the Master API: lookupNode found the node, or no such node


def publishers_and_subscribers() -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Returns the nodes that publish and subscribe, by topic. Raises any error if no master answers."""
    with _master() as server:
        answer: Any = server.getSystemState(rospy.get_name())
    publishers, subscribers = (
        {str(topic): [str(node) for node in nodes] for topic, nodes in entries} for entries in answer[2][:2]
    )
    return publishers, subscribers


def has_ended(node: str) -> bool:
    """Returns True if the process of ``node`` has ended, though the master may still list it.

    A node that hangs, or whose host is cut off, has not. Raises any error if the master does not answer.
    """
    uri = node_uri(node)
    if not uri:
        return True
    try:
        with ServerProxy(uri, transport=TimeoutTransport()) as server:
            server.getPid(rospy.get_name())
    except ConnectionRefusedError:
        return True
    except Exception:  # noqa: BLE001  whatever else happens, somebody may be there
        return False
    return False


def is_forgotten() -> bool:
    """Returns True if the master answers but does not know this node: it was restarted."""
    try:
        return not node_uri(rospy.get_name())
    except Exception:  # noqa: BLE001  a master that is away forgets nothing, and whatever else answers there is none
        return False


def pid() -> int:
    """Returns the number of the master's process. Raises any error if it does not answer."""
    with _master() as server:
        answer: Any = server.getPid(rospy.get_name())
    return int(answer[2])


def register(
    publications: Sequence[Sequence[str]],
    subscriptions: Sequence[Sequence[str]],
    services: Sequence[Sequence[str]],
) -> list[list[str]]:
    """Registers all of this node: topics with their types, services with their URIs.

    Returns the URIs of the publishers of each of ``subscriptions``. Raises any error.
    """
    name, uri = rospy.get_name(), rospy.get_node_uri()
    with _master() as server:
        calls = MultiCall(server)
        for topic, kind in publications:
            calls.registerPublisher(name, topic, kind, uri)
        for topic, kind in subscriptions:
            calls.registerSubscriber(name, topic, kind, uri)
        for service, place in services:
            calls.registerService(name, service, place, uri)
        results: Any = calls()
        answers: list[Any] = list(results)
    return [answer[2] for answer in answers[len(publications) :][: len(subscriptions)]]


def await_sim_time() -> None:
    """Waits for /use_sim_time where the swarm uses simulated time: a node reads it once, when it registers.

    The unit of the master sets it; the environment of the host has SWARM_USE_SIM_TIME=1 then.
    """
    if os.environ.get("SWARM_USE_SIM_TIME") != "1":
        return
    while True:
        try:
            with _master() as server:
                answer: Any = server.getParam("/swarm", "/use_sim_time")
            if answer[0] == _SUCCESS and answer[2] is True:
                return
        except Exception:  # noqa: BLE001  the master is away, or something else answers there
            pass
        time.sleep(_LOOK_EVERY)


def node_uri(node: str) -> str:
    """Returns the URI of ``node`` as the master lists it; empty if it knows no such node."""
    with _master() as server:
        answer: Any = server.lookupNode(rospy.get_name(), node)
    code, message, uri = answer
    if code not in (_SUCCESS, _UNKNOWN_NODE):
        raise OSError(message)
    return str(uri) if code == _SUCCESS else ""


def _master() -> ServerProxy:
    return ServerProxy(rosgraph.get_master_uri(), transport=TimeoutTransport())


class TimeoutTransport(Transport):
    """An HTTP transport with a timeout."""

    def make_connection(self, host: Any) -> HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _ANSWERS_WITHIN
        return connection
