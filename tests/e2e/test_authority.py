"""Authority: a robot obeys its declared commanders, one at a time; status reports other senders."""

from __future__ import annotations

import time

import pytest

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import LEADER, SOURCE, LabSwarm, Note, Run, quoted, until
from tests.timing import Promise

STRANGER = "epuck-pi"
LEADING, CENTRAL = "mode: leader\nleader: koala-laptop", "mode: central\nhub: koala-laptop"
CONTROL = "  - {by: koala-laptop, of: [koala, k3, epuck]}"
TWO = """\
  - {by: koala-laptop, of: [koala, epuck]}
  - {by: epuck-pi, of: [k3]}
  - {by: k3-pi, of: [k3], priority: 10}"""
LOW, HIGH = 0.05, 0.1  # m/s
# A node that the master lists on the leader; the connection that claims its name comes from another host.
FORGED = """
import os, time, xmlrpc.client
import rospy
from geometry_msgs.msg import Twist
master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
master.registerPublisher("/ghost", "/ghosts", "std_msgs/String", "http://LEADER:40000/")
rospy.init_node("intruder")
rospy.names.get_caller_id = lambda: "/ghost"
publisher = rospy.Publisher("/k3/cmd_vel", Twist, queue_size=1)
while publisher.get_num_connections() == 0:
    time.sleep(0.01)
command = Twist()
command.linear.x = 0.1
for _ in range(40):
    publisher.publish(command)
    time.sleep(0.05)
master.unregisterPublisher("/ghost", "/ghosts", "http://LEADER:40000/")
"""


def test_commands_of_another_host_move_nothing_and_are_reported(swarm: LabSwarm, note: Note) -> None:
    place = swarm.robot("k3")["distance"]
    with swarm.publishing(STRANGER, "k3", 0.1):
        took = until(lambda: "refuses /rostopic" in swarm.diagnosis(LEADER, "k3"), "no refusal")
        note("k3 names a stranger in /diagnostics after", f"{took:.1f} s", "")
        status = swarm.swarmctl("status")
        assert status.status == 0, status.out
        address = swarm.hosts[STRANGER]
        assert f"on {address} on /k3/cmd_vel; rejected by the driver" in status.out
        assert f"on {address}: not among its commanders {LEADER}" in status.out
        with swarm.driving(LEADER, "epuck", 0.05):
            assert "commanded by koala-laptop (/rostopic" in swarm.swarmctl("status").out
    assert swarm.robot("k3")["distance"] == place


def test_a_connection_that_claims_to_be_of_the_leader_moves_nothing(swarm: LabSwarm) -> None:
    place, leader = swarm.robot("k3")["distance"], swarm.hosts[LEADER]
    swarm.shell(STRANGER, f"{SOURCE}; echo {quoted(FORGED.replace('LEADER', leader))} | python3 -")
    assert swarm.robot("k3")["distance"] == place
    assert f"/ghost on {swarm.hosts[STRANGER]} (" in swarm.diagnosis(LEADER, "k3")


def test_the_leader_is_obeyed_while_a_stranger_shouts(swarm: LabSwarm) -> None:
    with swarm.publishing(STRANGER, "k3", 0.3), swarm.driving(LEADER, "k3", 0.1):
        speeds = set()
        for _ in range(50):
            speeds.add(round(swarm.robot("k3")["v"], 2))
            time.sleep(0.02)
        assert speeds == {0.1}
    swarm.seconds_to_standstill("k3")


@pytest.fixture
def two_commanders(swarm: LabSwarm) -> LabSwarm:
    """The example as mode central, where k3 has two commanders of different priority."""
    spec = swarm.variant(
        "two-commanders",
        ("mode: leader\nleader: koala-laptop", "mode: central\nhub: koala-laptop"),
        (CONTROL, TWO),
    )
    run = swarm.deploy(spec)
    assert run.status == 0, run.out + run.err
    return swarm


def test_the_higher_commander_takes_over_and_releases_by_its_silence(
    two_commanders: LabSwarm, note: Note, promise: Promise
) -> None:
    swarm = two_commanders

    def goes(speed: float) -> bool:
        return bool(swarm.robot("k3")["v"] == pytest.approx(speed, rel=0.05))

    with swarm.driving(STRANGER, "k3", LOW):
        until(lambda: goes(LOW), "k3 does not obey the lower one")
        with swarm.publishing("k3-pi", "k3", HIGH) as higher:
            taken = until(lambda: goes(HIGH), "k3 does not obey the higher one")
            note("k3 obeys its higher commander, the start of rostopic included, after", f"{taken:.2f} s", "")
            began = time.monotonic()
            while time.monotonic() < began + 1:
                assert goes(HIGH)
            higher.kill()
            back = until(lambda: goes(LOW), "k3 is not given back")
        promise("k3 goes back to its lower commander after SIGKILL of the higher", back, 1)
    swarm.seconds_to_standstill("k3")


def test_who_drove_is_recorded_and_an_edit_of_it_is_named(swarm: LabSwarm) -> None:
    def commands() -> Run:
        return swarm.swarmctl("history", "--commands", "--json", "--limit", "k3-pi")

    with swarm.driving(LEADER, "k3", LOW) as publisher:
        node = f"/rostopic_{publisher.pid}_"
        found = commands()
    assert found.status == 0, found.out + found.err
    span = [one for one in found.json()["commands"] if one["event"] == "commanded"][-1]
    assert (span["robot"], span["commander"], span["ongoing"]) == ("k3", LEADER, True)
    assert span["node"].startswith(node)
    swarm.shell("k3-pi", "sudo systemctl restart swarm-newswarm.k3")  # the end of the program ends its spans
    until(lambda: commands().json()["commands"][-1]["event"] == "started", "its start is not recorded")
    *_, ended, started = commands().json()["commands"]
    assert ended["node"] == span["node"]
    assert ended["seconds"] is not None
    assert started["commanders"] == [f"{LEADER} (priority 0)"]

    record = "/var/lib/swarm-commands/newswarm/k3/commands.jsonl"
    swarm.shell("k3-pi", f'sudo sed -i \'1s/"time": ./"time": 9/\' {record}')
    edited = commands()
    assert edited.status == exit_codes.HOSTS_FAILED
    (state,) = edited.json()["records"]
    assert "entry 2 does not follow entry 1" in state["problem"]
    swarm.shell("k3-pi", f"sudo rm {record} && sudo systemctl restart swarm-newswarm.k3")
    until(lambda: commands().status == 0, "a new record is not sound")
