"""What every node that takes commands needs of ROS 1: senders with their hosts, diagnostics, the master."""

from __future__ import annotations

import os
import threading
import time
from http.client import HTTPConnection
from typing import Any
from xmlrpc.client import ServerProxy, Transport

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Twist

from swarm_onboard.command.command_gate import CommandGate
from swarm_onboard.command.latched import Latched
from swarm_onboard.command.node_hosts import NodeHosts
from swarm_onboard.command.report import Report

_FAREWELL = 1.0  # s
_MASTER_ANSWERS = 2.0  # s
_LOOK_EVERY = 0.1  # s, for a parameter
_SUCCESS, _UNKNOWN_NODE = 1, -1  # of the Master API: lookupNode found the node, or no such node


def subscribe(topic: str, gate: CommandGate) -> None:
    """Passes the commands on ``topic`` (geometry_msgs/Twist), each with its sender, to ``gate``.

    What a publisher latched before this node connected is left out: it was meant for another moment.
    """
    node_hosts, latched = NodeHosts(_node_uri), Latched(_publishers(topic))

    def take(twist: Any) -> None:
        """Runs in the thread of the sender's connection, so its waiting delays no other sender's commands."""
        connection = twist._connection_header
        arrived, sender = time.monotonic(), str(connection.get("callerid", ""))
        if connection.get("latching") == "1" and latched.repeats(sender, connection):
            return
        linear, angular = twist.linear, twist.angular
        gate.give(
            sender,
            node_hosts.of(sender),
            (linear.x, linear.y, linear.z),
            (angular.x, angular.y, angular.z),
            arrived,
        )

    rospy.Subscriber(topic, Twist, take, queue_size=1, tcp_nodelay=True)


def _publishers(topic: str) -> list[str]:
    """The nodes that publish on ``topic`` now; none if the master does not answer."""
    try:
        with master() as server:
            answer: Any = server.getSystemState(rospy.get_name())
        found = dict(answer[2][0]).get(rospy.resolve_name(topic), [])
    except Exception:  # noqa: BLE001  then a command that was latched before counts as new
        return []
    return [str(node) for node in found]


class Diagnostics:
    """Publishes the reports of one part of a robot on /diagnostics."""

    def __init__(self, name: str, hardware: str) -> None:
        self._name = name
        self._hardware = hardware
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)

    def publish(self, report: Report) -> None:
        """Publishes ``report``."""
        status = DiagnosticStatus(
            level=int(report.level),
            name=self._name,
            message=report.message,
            hardware_id=self._hardware,
            values=[KeyValue(key, value) for key, value in report.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)


def leave() -> None:
    """Unregisters this node; a master that is gone is not waited for."""
    farewell = threading.Thread(target=rospy.signal_shutdown, args=("the node ends",), daemon=True)
    farewell.start()
    farewell.join(_FAREWELL)


def forgotten() -> bool:
    """Returns True if the master answers but does not know this node: it was restarted."""
    try:
        return not _node_uri(rospy.get_name())
    except Exception:  # noqa: BLE001  a master that is away forgets nothing, and whatever else answers there is none
        return False


def await_sim_time() -> None:
    """Waits for /use_sim_time where the swarm uses simulated time: a node reads it once, when it registers.

    The unit of the master sets it; the environment of the host has SWARM_USE_SIM_TIME=1 then.
    """
    if os.environ.get("SWARM_USE_SIM_TIME") != "1":
        return
    while True:
        try:
            with master() as server:
                answer: Any = server.getParam("/swarm", "/use_sim_time")
            if answer[0] == _SUCCESS and answer[2] is True:
                return
        except Exception:  # noqa: BLE001  the master is away, or something else answers there
            pass
        time.sleep(_LOOK_EVERY)


def ended(node: str) -> bool:
    """Returns True if the process of ``node`` has ended, though the master may still list it.

    A node that hangs, or whose host is cut off, has not. Raises any error if the master does not answer.
    """
    uri = _node_uri(node)
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


def master() -> ServerProxy:
    """Returns the master; a call raises an error if it does not answer within two seconds."""
    return ServerProxy(rosgraph.get_master_uri(), transport=TimeoutTransport())


class TimeoutTransport(Transport):
    """An HTTP transport with a timeout."""

    def make_connection(self, host: Any) -> HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _MASTER_ANSWERS
        return connection


def _node_uri(node: str) -> str:
    """Returns the URI of ``node`` as the master lists it; empty if it knows no such node."""
    with master() as server:
        answer: Any = server.lookupNode(rospy.get_name(), node)
    code, message, uri = answer
    if code not in (_SUCCESS, _UNKNOWN_NODE):
        raise OSError(message)
    return str(uri) if code == _SUCCESS else ""
