"""Faults of the graph that leave all units running: publishers, connections, a host's firewall."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

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


REFUSING = """
table inet strict {
  chain input {
    type filter hook input priority 0;
    iif lo accept
    ct direction reply accept
    tcp dport != 22 reject with tcp reset
  }
}
"""  # connections of before as well: a master keeps those to its nodes open
PILOT = """
import sys, rospy
from geometry_msgs.msg import Twist
if sys.argv[1] == "changed":
    Twist._md5sum = "0" * 32
rospy.init_node("pilot")
publisher = rospy.Publisher("/k3/cmd_vel", Twist, queue_size=1)
while not rospy.is_shutdown():
    publisher.publish(Twist())
    rospy.sleep(0.2)
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
def firewall(swarm: LabSwarm, host: str, rules: str = FIREWALL) -> Iterator[None]:
    """A host that lets in nothing but connections of ssh and to a ROS master."""
    swarm.shell(host, f"printf %s {quoted(rules)} | sudo nft -f -")
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
        cause = f"✗ connection /k3/driver on {HOST} to /rostopic_"
        text = next((line for line in seen.out.splitlines() if line.startswith(cause)), "")
        assert text, seen.out
        assert f" on {LEADER}: cannot connect to 192.168.77.10:" in text
        assert f"check the firewall on {LEADER}: sudo nft list ruleset" in seen.out
        assert not moves(swarm.robot("k3"))
        promise("status names a commander's firewall", seen.seconds, 10)
    with swarm.driving(LEADER, "k3", 0.1):
        assert swarm.swarmctl("status").status == 0


@contextmanager
def pilot(swarm: LabSwarm, messages: str = "") -> Iterator[None]:
    """A node on the commander's host that publishes commands. ``messages``: `changed`, another definition."""
    begun = f"{ROS}; nohup python3 -c {quoted(PILOT)} {messages or 'same'} >/dev/null 2>&1 & echo $!"
    pid = swarm.shell(LEADER, begun).split()[-1]
    nodes = f"{ROS}; rosnode list"
    until(lambda: "/pilot" in swarm.shell(LEADER, nodes).split(), "the pilot does not start")
    try:
        yield
    finally:
        swarm.shell(LEADER, f"kill -INT {pid}")
        until(lambda: "/pilot" not in swarm.shell(LEADER, nodes).split(), "the pilot does not end")


def test_a_lost_announcement_of_a_publisher_is_named(swarm: LabSwarm) -> None:
    """The master announces a publisher once; where that call is lost, the robot never obeys it."""
    with ExitStack() as until_end:
        with firewall(swarm, HOST, REFUSING):
            until_end.enter_context(pilot(swarm))
        pair = f"subscription /k3/driver on {HOST} to /pilot on {LEADER}: there is no connection"
        until(lambda: first_cause(swarm).startswith(f"✗ {pair}"), "it is not named")
        seen = swarm.swarmctl("status", "--json").json()
        [found] = [one for one in seen["findings"] if one["check"] == "subscription"]
        swarm.shell(HOST, found["hint"].partition(f"on {HOST}: ")[2].partition(";")[0])
        until(lambda: swarm.swarmctl("status").status == 0, "the restart does not repair it")


def test_a_publisher_of_another_definition_of_the_type_is_named(swarm: LabSwarm) -> None:
    with pilot(swarm, "changed"):
        pair = f"subscription /k3/driver on {HOST} to /pilot on {LEADER}"
        reason = "geometry_msgs/Twist is another message (MD5 sum 9f195f88 here, 00000000 there)"
        until(lambda: first_cause(swarm).startswith(f"✗ {pair}: {reason}"), "it is not named")
    until(lambda: swarm.swarmctl("status").status == 0, "it is not healthy again")
