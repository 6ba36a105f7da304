"""Ways in which a node ends that nobody has stopped, or would; how soon its unit has brought it back."""

from __future__ import annotations

import time
from collections.abc import Mapping

from tests.e2e.lab_swarm import SOURCE, SWARM, LabSwarm, SshError, quoted, until

BACK = 15.0  # s within which a node that has ended once answers again
_SHUTDOWN = """
import contextlib, rosgraph, sys, xmlrpc.client
uri = rosgraph.Master("/stranger").lookupNode(sys.argv[1])
with contextlib.suppress(OSError):  # the node may end before it answers
    xmlrpc.client.ServerProxy(uri).shutdown("/stranger", "for no reason")
"""
_SECOND = """
import rospy
rospy.init_node("second")
rospy.spin()
"""
#: Ways that end the nodes of other packages, but neither a driver of swarmctl nor a gate.
OF_STRANGERS = ("rosnode kill", "a stranger's shutdown request", "a second node of its name")
#: Commands of a shell, by what they are. ``{node}`` is the name of the node, ``{unit}`` its unit.
WAYS: Mapping[str, str] = {
    "rosnode kill": "rosnode kill {node}",
    "a stranger's shutdown request": f"python3 -c {quoted(_SHUTDOWN)} {{node}}",
    "a clean exit": "sudo systemctl kill --kill-who=main -s TERM {unit}",
    "a second node of its name": f"timeout 20 python3 -c {quoted(_SECOND)} __ns:={{space}} __name:={{name}}",
}


def ends_and_is_back(swarm: LabSwarm, host: str, part: str, node: str, way: str) -> float:
    """Ends ``node`` of the unit of ``part``; returns after how many s another process answers."""
    before = swarm.units(host)[part].pid
    assert answers(swarm, host, node), f"{node} does not answer before {way}"
    began = time.monotonic()
    unit = tries(swarm, host, part, node, way)

    def back() -> bool:
        seen = swarm.units(host)[part]
        return seen.active == "active" and seen.pid not in (0, before) and answers(swarm, host, node)

    until(back, f"{part} is not back after {way}")
    took = time.monotonic() - began
    swarm.shell(host, f"sudo systemctl reset-failed {unit}")  # the restarts of this test are no trouble
    return took


def tries(swarm: LabSwarm, host: str, part: str, node: str, way: str) -> str:
    """Does what ends most nodes to ``node`` of the unit of ``part``; returns the name of the unit."""
    unit = f"swarm-{SWARM}.{part}.service"
    space, _, name = node.rpartition("/")
    swarm.shell(host, f"{SOURCE}; {WAYS[way].format(node=node, unit=unit, space=space, name=name)}")
    return unit


def answers(swarm: LabSwarm, host: str, node: str) -> bool:
    """True if the master has the node and it answers."""
    try:
        return "xmlrpc reply" in swarm.shell(host, f"{SOURCE}; timeout 5 rosnode ping -c 1 {node}")
    except SshError:
        return False
