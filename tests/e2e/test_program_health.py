"""Status of launch files on real hosts: stopped and dead nodes, and two nodes that end each other."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import LabSwarm, quoted, until
from tests.timing import Promise

HOSTS = ("k3-pi", "epuck-pi")
FOLDER = "/usr/share/talking"
PACKAGE = """<package format="2"><name>talking</name><version>1.0.0</version>
<description>says it</description><maintainer email="a@b.example">a</maintainer><license>BSD</license>
</package>"""
NODE = """#!/usr/bin/env python3
import rospy
from std_msgs.msg import String

rospy.init_node("any")
publisher = rospy.Publisher("words", String, queue_size=1)
pace = rospy.Rate(30)
while not rospy.is_shutdown():
    publisher.publish("so")
    pace.sleep()
"""
TWO = """<launch><node pkg="talking" type="say.py" name="first"/>
<node pkg="talking" type="say.py" name="second"><remap from="words" to="others"/></node></launch>"""
ONE = '<launch><node pkg="talking" type="say.py" name="eyes" required="true"/></launch>'
FILES = {"package.xml": PACKAGE, "say.py": NODE, "launch/two.launch": TWO, "launch/eyes.launch": ONE}
TALK = """
programs:
  talk:
    host: k3-pi
    package: talking
    launch: two.launch
    publishes: [{topic: words, type: std_msgs/String, rate: 30}]
"""
PAIR = """
programs:
  left: {host: k3-pi, package: talking, launch: eyes.launch}
  right: {host: epuck-pi, package: talking, launch: eyes.launch}
"""
LOOP = """
programs:
  loop: {host: k3-pi, command: [sh, -c, "%s"]}
"""


@pytest.fixture
def talking(swarm: LabSwarm) -> Iterator[LabSwarm]:
    """The swarm, with a package of two launch files on two of its hosts."""
    put = "; ".join(
        f"printf %s {quoted(text)} | sudo tee {FOLDER}/{name} >/dev/null" for name, text in FILES.items()
    )
    for host in HOSTS:
        swarm.shell(host, f"sudo mkdir -p {FOLDER}/launch; {put}; sudo chmod +x {FOLDER}/say.py")
    yield swarm
    for host in HOSTS:
        swarm.shell(host, f"sudo rm -r {FOLDER}")


def deployed(swarm: LabSwarm, name: str, programs: str) -> Path:
    spec = swarm.folder / f"{name}.yaml"
    spec.write_text(swarm.spec.read_text() + programs)
    done = swarm.deploy(spec)
    assert done.status == 0, done.out + done.err
    return spec


def signal(swarm: LabSwarm, name: str, node: str) -> None:
    swarm.shell("k3-pi", f"sudo pkill -{name} -f '[_]_name:={node}'")


def test_a_launched_node_that_stops_or_dies_is_unhealthy(talking: LabSwarm) -> None:
    swarm, spec = talking, deployed(talking, "talk", TALK)
    until(lambda: swarm.swarmctl("status", spec=spec).status == 0, "the swarm does not get well")
    document = swarm.swarmctl("status", "--json", spec=spec).json()
    rates = [one["message"] for one in document["findings"] if one["key"] == "topic /words of talk"]
    assert rates
    assert rates[0].startswith("measured ")

    signal(swarm, "STOP", "first")
    stopped = swarm.findings(spec=spec)
    assert "a signal has stopped its process" in stopped["program talk"]["message"]
    assert "(say.py)" in stopped["program talk"]["message"]
    signal(swarm, "CONT", "first")
    until(lambda: not swarm.findings(spec=spec), "the swarm does not get well again")

    signal(swarm, "KILL", "second")
    until(lambda: "program talk" in swarm.findings(spec=spec), "the dead node is not reported")
    message = swarm.findings(spec=spec)["program talk"]["message"]
    assert message == "its node /second has ended (exit code -9) and is not started again"


@pytest.mark.slow
def test_two_nodes_that_end_each_other_are_named_at_every_look(talking: LabSwarm, promise: Promise) -> None:
    swarm = talking
    spec = deployed(swarm, "pair", PAIR)
    cause = "node name /eyes"
    took = until(lambda: cause in swarm.findings(spec=spec), "the equal names are not found")
    promise("two nodes of one name are found after", took, 60)
    for _ in range(5):
        run = swarm.swarmctl("status", spec=spec)
        assert run.status == exit_codes.UNHEALTHY, run.out
        words = " ".join(run.out.split())
        assert words.count("two nodes are called /eyes, on hosts k3-pi and epuck-pi") == 1, run.out
    log = "sudo journalctl -u swarm-newswarm.left.service -o cat"
    until(lambda: "starts again in" in swarm.shell("k3-pi", log), "they fight at full speed")


@pytest.mark.slow
def test_a_deploy_that_repairs_a_crash_loop_begins_a_new_count(swarm: LabSwarm) -> None:
    def restarted(spec: Path) -> bool:
        message = swarm.findings(spec=spec).get("program loop", {}).get("message", "")
        return "within 10 min" in message or "crash loop" in message

    crashes = "sleep 0.5; exit 1"
    spec = deployed(swarm, "loop", LOOP % crashes)
    until(lambda: restarted(spec), "the crash loop is not found")
    repaired = deployed(swarm, "repaired", LOOP % "exec sleep 1000")
    assert "program loop" not in swarm.findings(spec=repaired)
    spec = deployed(swarm, "loop", LOOP % crashes)
    until(lambda: restarted(spec), "the crash loop after the repair is not found")
