"""Faults of the graph that leave all units running: second and silent publishers, a host's firewall."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from tests.e2e.lab_swarm import HOME, LEADER, LabSwarm, moves, quoted, until
from tests.timing import Promise

HOST = "k3-pi"
ROS = f". {HOME}/current/setup.bash"
DEAD = """
import os, xmlrpc.client
master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
print(master.registerPublisher("/dead", "/k3/cmd_vel", "geometry_msgs/Twist", "http://k3-pi:9/"))
"""


FIREWALL = """
table inet strict {
  chain input {
    type filter hook input priority 0; policy drop;
    iif lo accept
    ct state established,related accept
    tcp dport { 22, 11311 } accept
  }
}
"""


def first_cause(swarm: LabSwarm) -> str:
    out = swarm.swarmctl("status").out
    return next((line for line in out.splitlines()[1:] if line), "")


GRAPH = """
import os, xmlrpc.client
master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
sides = master.getSystemState("/look")[2]
print([sorted([topic, sorted(nodes)] for topic, nodes in side) for side in sides])
print(sorted(master.getTopicTypes("/look")[2]), sorted(master.getParamNames("/look")[2]))
"""


def test_a_look_changes_nothing_in_the_graph(swarm: LabSwarm) -> None:
    before = swarm.shell(HOST, f"{ROS}; python3 -c {quoted(GRAPH)}")
    assert "/k3/cmd_vel" in before
    assert swarm.swarmctl("status").status == 0
    assert swarm.shell(HOST, f"{ROS}; python3 -c {quoted(GRAPH)}") == before


def test_a_second_publisher_of_odometry_is_named(swarm: LabSwarm) -> None:
    begun = f"{ROS}; nohup rostopic pub -r 5 /k3/odom nav_msgs/Odometry '{{}}' >/dev/null 2>&1 & echo $!"
    pid = swarm.shell(HOST, begun).split()[-1]
    try:
        until(lambda: "publishes it as well as /k3/driver" in first_cause(swarm), "it is not named")
        assert first_cause(swarm).startswith("✗ publisher /k3/odom: /rostopic_")
    finally:
        swarm.shell(HOST, f"kill -INT {pid}")
    until(lambda: swarm.swarmctl("status").status == 0, "it is not healthy again")


def test_a_publisher_that_has_ended_is_named_and_taken_out(swarm: LabSwarm) -> None:
    swarm.shell(HOST, f"{ROS}; python3 -c {quoted(DEAD)}")
    seen = swarm.swarmctl("status", "--json").json()
    found = next(one for one in seen["findings"] if one["key"] == "publisher /k3/cmd_vel")
    assert found["state"] == "warning"
    assert "/dead" in found["message"]  # beside publishers that other tests have killed
    swarm.shell(HOST, found["hint"].partition(f"on {HOST}: ")[2])
    again = swarm.swarmctl("status", "--json").json()
    assert "publisher /k3/cmd_vel" not in [one["key"] for one in again["findings"]]


@contextmanager
def firewall(swarm: LabSwarm, host: str) -> Iterator[None]:
    """A host that lets in nothing but connections of ssh and to a ROS master."""
    swarm.shell(host, f"printf %s {quoted(FIREWALL)} | sudo nft -f -")
    try:
        yield
    finally:
        swarm.shell(host, "sudo nft delete table inet strict")


def test_a_firewall_of_a_robots_host_is_named(swarm: LabSwarm, promise: Promise) -> None:
    with firewall(swarm, HOST):
        seen = swarm.swarmctl("status")
        assert seen.status == 5, seen.out
        text = next(line for line in seen.out.splitlines()[1:] if line)
        pair = f"the master on {LEADER} to /k3/driver on {HOST}"
        assert text.startswith(f"✗ connection {pair}: cannot connect to 192.168.77.11:"), seen.out
        promise("status names a robot's firewall", seen.seconds, 10)
    assert swarm.swarmctl("status").status == 0


def test_a_firewall_of_the_commanders_host_is_named(swarm: LabSwarm, promise: Promise) -> None:
    """The robot's host cannot connect to the publisher: all units run, and the robot stands."""
    with firewall(swarm, LEADER), swarm.publishing(LEADER, "k3", 0.1):
        until(lambda: "cannot connect to" in first_cause(swarm), "it is not named")
        seen = swarm.swarmctl("status")
        assert seen.status == 5, seen.out
        text = next(line for line in seen.out.splitlines()[1:] if line)
        assert text.startswith(f"✗ connection /k3/driver on {HOST} to /rostopic_"), seen.out
        assert f" on {LEADER}: cannot connect to 192.168.77.10:" in text
        assert f"check the firewall on {LEADER}: sudo nft list ruleset" in seen.out
        assert not moves(swarm.robot("k3"))
        promise("status names a commander's firewall", seen.seconds, 10)
    with swarm.driving(LEADER, "k3", 0.1):
        assert swarm.swarmctl("status").status == 0
