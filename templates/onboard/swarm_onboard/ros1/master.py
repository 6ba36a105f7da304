"""What a node of ROS 1 looks up at its master, each within two seconds."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from http.client import HTTPConnection
from typing import Any, Sequence
from xmlrpc.client import MultiCall, ServerProxy, Transport

import rosgraph
import rospy
from rospy.impl.masterslave import ROSHandler
from rospy.impl.registration import get_registration_listeners, get_service_manager, get_topic_manager

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


_TAKES_BACK_EVERY = 5.0  # s at least: two nodes of one name do not storm the master
_LONGEST_REASON = 200


def ignore_shutdown_requests() -> None:
    """Call it before joining. A master asks a node to end when another one, of anybody, has its name."""
    ROSHandler.shutdown = _ignored


def _ignored(_handler: ROSHandler, _caller: Any, reason: Any = "") -> tuple[int, str, int]:
    text = "".join(one if one.isprintable() else " " for one in str(reason)[:_LONGEST_REASON])
    # The first line is the one of rospy, in which `status` finds who has taken the name.
    print(
        f"shutdown request: {text}\nWARN: ignored: only its unit ends this node", file=sys.stderr, flush=True
    )
    return 1, "this node ends with its unit only", 0


class Registration:
    """That of the node of this process at its master, which knows it already."""

    def __init__(self) -> None:
        self._master = 0
        with contextlib.suppress(Exception):  # it went away meanwhile: the next one counts as another
            self._master = pid()
        self._next = -float("inf")

    def is_kept(self) -> bool:
        """Takes the name back if the master has it elsewhere or no more.

        Returns False if that is another master than before: it was restarted.
        """
        try:
            uri = node_uri(rospy.get_name())
            if uri == rospy.get_node_uri():
                return True
            if pid() != self._master:
                return False
            if time.monotonic() >= self._next:
                self._next = time.monotonic() + _TAKES_BACK_EVERY
                where = f"was at {uri[:80]}" if uri else "was lost"
                print(f"WARN: registration {where}: taken back", file=sys.stderr, flush=True)
                _register()
        except Exception:  # noqa: BLE001  a master that is away forgets nothing, and whatever else answers is none
            pass
        return True


def _register() -> None:
    """Registers what this node has, in one request, and connects to publishers that came meanwhile."""
    topics = get_topic_manager()
    subscribed = topics.get_subscriptions()
    found = register(topics.get_publications(), subscribed, get_service_manager().get_services())
    for (topic, _), publishers in zip(subscribed, found):
        for listener in get_registration_listeners().listeners:
            listener.publisher_update(topic, publishers)
