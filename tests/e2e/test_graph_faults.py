"""Faults of the graph that leave all units running: second and silent publishers, a host's firewall."""

from __future__ import annotations

from tests.e2e.lab_swarm import HOME, LabSwarm, quoted, until
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
    tcp dport 22 accept
  }
}
"""


def first_cause(swarm: LabSwarm) -> str:
    out = swarm.swarmctl("status").out
    return next((line for line in out.splitlines()[1:] if line), "")


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


def test_a_firewall_that_lets_no_commands_in_is_named(swarm: LabSwarm, promise: Promise) -> None:
    swarm.shell(HOST, f"printf %s {quoted(FIREWALL)} | sudo nft -f -")
    try:
        seen = swarm.swarmctl("status")
        assert seen.status == 5, seen.out
        text = next(line for line in seen.out.splitlines()[1:] if line)
        assert text.startswith(f"✗ peer k3: koala-laptop cannot connect to /k3/driver on {HOST}: "), seen.out
        promise("status names a host's firewall", seen.seconds, 10)
    finally:
        swarm.shell(HOST, "sudo nft delete table inet strict")
    assert swarm.swarmctl("status").status == 0
