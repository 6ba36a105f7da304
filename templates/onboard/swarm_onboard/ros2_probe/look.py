"""A node that looks at the graph and reports it as JSON. It is a process of its own, with rclpy."""

from __future__ import annotations

import json
import os
import resource
import sys
import time
from contextlib import contextmanager
from importlib import import_module
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Iterator, Mapping

from swarm_onboard.agent.texts import clipped
from swarm_onboard.ros2_probe import announcements, discovery
from swarm_onboard.ros2_probe.discovery import Discovery
from swarm_onboard.ros2_probe.endpoints import HIDDEN, Endpoint, Graph, full_name, parts
from swarm_onboard.ros2_probe.listening import Listening

if TYPE_CHECKING:
    from swarm_onboard.agent.observations import LaunchedSeen, NodeSeen
    from swarm_onboard.agent.verbs.probe import Request

NAME = f"{HIDDEN}swarm_status_"
LARGEST = 8 << 20  # bytes of what it prints
_LONGEST_LISTENING = 15.0  # s for one topic
_LATE = 2.0  # s until a new subscription receives, and of work after the listening
_TURN = 0.05  # s of receiving between two looks at the clock
_LOOK_EVERY = 0.25  # s
_MOST_TOPICS = 2000
_GOALS, _GOAL = "/_action/send_goal", "_SendGoal"  # how a service of an action ends, and its type
_QUIETLY = ("--ros-args", "--disable-stdout-logs", "--disable-rosout-logs", "--disable-external-lib-logs")


def longest(request: Request) -> float:
    """For how long the node looks at most, s."""
    topics = (*request.nodes.values(), *request.launched.values())
    listening = (seconds for one in topics for seconds in one.values())
    return discovery.LONGEST + min(max(listening, default=0.0), _LONGEST_LISTENING) + _LATE


def main() -> None:
    """Reads a ``Request`` of ``probe`` and prints fields of its ``Answer`` in one line, or an ``error``."""
    request: Any = SimpleNamespace(**json.load(sys.stdin))
    try:
        answer: Any = _seen(request)
    except ImportError as error:
        answer = {"error": f"rclpy cannot be imported: {error}"}
    except Exception as error:  # noqa: BLE001  whatever ROS raises, people get its words
        answer = {"error": f"no node of this host can join the graph: {clipped(error, 200)}"}
    print(json.dumps(answer))
    sys.stdout.flush()
    os._exit(0)  # some rmw hang while Python ends


def _seen(request: Request) -> dict[str, Any]:
    resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST, LARGEST))
    with joined(_own_name()) as node:
        executor = import_module("rclpy.executors").SingleThreadedExecutor()
        executor.add_node(node)
        return _looked(request, node, lambda: executor.spin_once(timeout_sec=_TURN))


@contextmanager
def joined(name: str) -> Iterator[Any]:
    """Yields a node that offers and prints nothing of its own, and leaves the graph at the end."""
    rclpy, signals = import_module("rclpy"), import_module("rclpy.signals")  # the agent has none
    send_on = announcements.held(os.environ)
    rclpy.init(args=list(_QUIETLY), signal_handler_options=signals.SignalHandlerOptions.NO)
    node = rclpy.create_node(name, start_parameter_services=False, enable_rosout=False)
    send_on()
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.shutdown()


def _own_name() -> str:
    """A name that no probe of another host has: those that booted alike look at once, under the same PID."""
    return f"{NAME}{os.urandom(8).hex()}"


def _looked(request: Request, node: Any, turn: Any) -> dict[str, Any]:
    """Waits until the whole graph is seen and measured, or time is up. ``turn`` receives for a moment."""
    from swarm_onboard.ros2.senders import subscribe_with_sender  # noqa: PLC0415  the agent has no rclpy

    listening = Listening(request, node, _LONGEST_LISTENING, subscribe_with_sender)
    began = time.monotonic()
    end = began + longest(request)
    provided = bool(request.provides) or any(one["provides"] for one in request.expected.values())
    looked, discovered, graph = 0.0, Discovery(request, began), graph_of(node, services=provided)
    while time.monotonic() < end:
        turn()
        now = time.monotonic()
        listening.end(now)
        if now >= looked + _LOOK_EVERY:
            looked, graph = now, graph_of(node, services=provided)
            listening.begin(graph, now)
            discovered.look(graph, now)
        if discovered.finished and not listening.running:
            break
    listening.end(time.monotonic(), all_=True)
    found = parts(graph, request)

    def known(nodes: Mapping[str, NodeSeen]) -> dict[str, NodeSeen]:
        return {name: listening.measured(name, discovered.node(name, node)) for name, node in nodes.items()}

    launched: dict[str, LaunchedSeen] = found["launched"]
    found["nodes"] = known(found["nodes"])
    found["launched"] = {
        unit: discovered.launched(unit, one._replace(nodes=known(one.nodes)))
        for unit, one in launched.items()
    }
    found["incomplete"] = discovered.incomplete
    if listening.lacking:
        kinds = ", ".join(listening.lacking)
        found["troubles"] = {"ros": clipped(f"not measured, as this host lacks the type: {kinds}")}
    return found


def graph_of(node: Any, *, services: bool) -> Graph:
    """Returns the graph as ``node`` sees it, without nodes of this kind; with ``services`` if these count."""
    topics = [name for name, _ in node.get_topic_names_and_types()][:_MOST_TOPICS]
    nodes = [one for one in node.get_node_names_and_namespaces() if not one[0].startswith(NAME)]
    own = node.get_publishers_info_by_topic("/parameter_events")
    mine = [bytes(one.endpoint_gid) for one in own if one.node_name == node.get_name()]
    return Graph(
        nodes=[full_name(space, name) for name, space in nodes],
        publishers=[
            one for topic in topics for one in _ends(topic, node.get_publishers_info_by_topic(topic))
        ],
        subscriptions=[
            one for topic in topics for one in _ends(topic, node.get_subscriptions_info_by_topic(topic))
        ],
        own_gid=mine[0] if mine else b"",
        services={full_name(space, name): dict(_services(node, name, space)) for name, space in nodes}
        if services
        else {},
        incompatible=_incompatible,
    )


def _services(node: Any, name: str, space: str) -> Iterator[tuple[str, str]]:
    """Yields the services and actions of a node with their types; an action has three services."""
    try:
        found = node.get_service_names_and_types_by_node(name, space)
    except Exception:  # noqa: BLE001  it has left meanwhile; the error differs from distribution to distribution
        return
    for service, (kind, *_) in found:
        if service.endswith(_GOALS):
            yield service[: -len(_GOALS)], kind[: -len(_GOAL)]
        else:
            yield service, kind


def _ends(topic: str, infos: Any) -> list[Endpoint]:
    return [
        Endpoint(
            full_name(one.node_namespace, one.node_name),
            topic,
            one.topic_type,
            str(getattr(one, "topic_type_hash", "")),  # since Iron
            bytes(one.endpoint_gid),
            one.qos_profile,
        )
        for one in infos
        if not one.node_name.startswith(NAME)
    ]


def _incompatible(publisher: Any, subscription: Any) -> str:
    qos = import_module("rclpy.qos")
    compatibility, reason = qos.qos_check_compatible(publisher, subscription)
    if compatibility != qos.QoSCompatibility.ERROR:
        return ""
    faults = (one.strip() for one in reason.split(";"))
    return "; ".join(one[len("ERROR: ") :] for one in faults if one.startswith("ERROR: ")) or "unknown"
