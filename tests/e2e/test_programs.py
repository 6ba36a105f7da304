"""Programs: a node of a ROS package runs in a namespace and outlives masters; an absent one is skipped."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.lab_swarm import (
    LEADER,
    SOURCE,
    LabSwarm,
    Note,
    quoted,
    until,
)
from tests.timing import Promise

TEXT = 'it\'s 100 % "so" $(so)'
#: Writes a file by a relative path, if the camera opens and the disk, of the same group, does not.
OPENS = "if test -w /dev/video0 -a ! -w /dev/disk0; then touch opens; fi"
PROGRAMS = """
programs:
  shout:
    robot: k3
    package: shouting
    executable: shout.py
    params:
      text: "it's 100 % \\"so\\" $(so)"
      rate: 5.0
      place: $(find shouting)/map
      limits: {file: limits.yaml}
      sizes: {low: [1, 2]}
    files: {greeting.txt: {template: greeting.j2}}
    publishes: [{topic: words, type: std_msgs/String}]
    provides: [{name: ~get_loggers, type: roscpp/srv/GetLoggers}]
  log:
    robot: k3
    command: [bash, -c, "exec rostopic echo -p words > /home/robot/{host}-{robot}.csv"]
  greet:
    host: k3-pi
    namespace: k3/hall
    lifecycle: oneshot
    command: [bash, -c, "rosparam set greeting hello; env > /home/robot/greet; OPENS"]
  once:
    robot: k3
    package: shouting
    executable: shout.py
    args: [--once]
    params: {text: once, rate: 1.0}
    lifecycle: oneshot
    optional: true
  by-hand:
    robot: k3
    package: shouting
    executable: shout.py
    args: [--once]
    params: {text: typed, rate: 1.0}
    lifecycle: interactive
  gmapping: {host: koala-laptop, package: gmapping, executable: slam_gmapping, optional: true}
""".replace("OPENS", OPENS)
PACKAGE = """<package format="2"><name>shouting</name><version>1.0.0</version>
<description>says it</description><maintainer email="a@b.example">a</maintainer><license>BSD</license>
</package>"""
NODE = """#!/usr/bin/env python3
import sys

import rospy
from std_msgs.msg import String

rospy.init_node("any")
publisher = rospy.Publisher("words", String, queue_size=1)
pace = rospy.Rate(rospy.get_param("~rate"))
while not rospy.is_shutdown():
    publisher.publish(rospy.get_param("~text"))
    pace.sleep()
    if "--once" in sys.argv:
        print("one", rospy.get_name(), rospy.get_param("~text"), sys.stdin.readline().strip())
        sys.exit(3)
"""
FOLDER = "/usr/share/shouting"
EXPOSED_AT_MOST = 2.0


@pytest.fixture
def spec(swarm: LabSwarm) -> Iterator[Path]:
    """The example with two programs, deployed; the package of one of them is on its host."""
    path = swarm.folder / "programs.yaml"
    path.write_text(swarm.spec.read_text() + PROGRAMS)
    (swarm.folder / "limits.yaml").write_text("upper: [3, 4]\n")
    (swarm.folder / "greeting.j2").write_text("{{ host }} of {{ robots | join(' ') }}\n")
    bare = swarm.swarmctl("plan", spec=path)
    assert "it lacks the ROS package shouting" in bare.out + bare.err
    put = f"sudo mkdir -p {FOLDER}; cd {FOLDER}; printf %s {quoted(PACKAGE)} | sudo tee package.xml"
    put += f"; printf %s {quoted(NODE)} | sudo tee shout.py; sudo chmod +x shout.py"
    put += "; cd /dev; sudo mknod -m 660 video0 c 81 0; sudo mknod -m 660 disk0 b 7 0"
    put += "; sudo chgrp video video0 disk0"
    swarm.shell("k3-pi", put)
    done = swarm.deploy(path)
    assert done.status == 0, done.out + done.err
    yield path
    swarm.shell("k3-pi", f"sudo rm -r {FOLDER} /dev/video0 /dev/disk0")


def received(swarm: LabSwarm) -> str:
    """What is received on the leader, or nothing."""
    return swarm.shell(
        LEADER, f"{SOURCE}; timeout 5 rostopic echo -n 1 -p /k3/words | tail -n 1 || true"
    ).strip()


def test_programs_survive_their_master_and_optional_ones_are_left_out(
    swarm: LabSwarm, spec: Path, promise: Promise
) -> None:
    until(lambda: TEXT in received(swarm), "the program is not received")
    assert "gmapping" not in swarm.shell(LEADER, f"{SOURCE}; rosnode list")
    assert "program `gmapping` is skipped: the host lacks the ROS package gmapping" in swarm.plan(spec).out

    shown = swarm.swarmctl("status", spec=spec)
    assert shown.status == 0, shown.out
    skipped = next(line for line in shown.out.splitlines() if line.startswith("- skipped: "))
    assert "program gmapping" in skipped
    details = swarm.swarmctl("status", "--details", spec=spec).out
    assert "gmapping: is skipped: host koala-laptop lacks the ROS package gmapping" in details
    assert "/k3/shout" in shown.out
    more = spec.with_name("more-services.yaml")
    more.write_text("programs: {shout: {provides: [{name: hush, type: std_srvs/srv/Trigger}]}}\n")
    assert (
        "/k3/shout does not provide /k3/hush" in swarm.swarmctl("status", "--file", str(more), spec=spec).out
    )

    swarm.shell(LEADER, "sudo systemctl kill --signal=KILL swarm-newswarm.master")
    began = time.monotonic()
    until(lambda: "/k3/shout" not in nodes(swarm), "the master is still the old one")
    until(lambda: "/k3/shout" in nodes(swarm), "the program does not join the new master")
    promise("a program is back after its master was killed", time.monotonic() - began, 15)
    until(lambda: TEXT in received(swarm), "the program is not received again")
    until(lambda: swarm.swarmctl("status", spec=spec).status == 0, "the swarm does not get well")


def nodes(swarm: LabSwarm) -> list[str]:
    return swarm.shell(LEADER, f"{SOURCE}; rosnode list 2>/dev/null || true").split()


def test_units_expose_little_and_have_limits(swarm: LabSwarm, spec: Path, note: Note) -> None:
    for host in swarm.hosts:
        for unit in (f"swarm-newswarm.{name}.service" for name in swarm.units(host)):
            output = swarm.shell(host, f"systemd-analyze security --no-pager {unit} | tail -n 1")
            exposure = float(re.findall(r": ([0-9.]+) ", output)[0])
            note(f"exposure of {host} {unit}", f"{exposure}", f"<= {EXPOSED_AT_MOST}")
            assert exposure <= EXPOSED_AT_MOST, f"{host} {unit}: {exposure}"
            limits = swarm.shell(host, f"systemctl show -p MemoryMax -p TasksMax --value {unit}").split()
            assert len(limits) == 2
            assert "infinity" not in limits, f"{host} {unit}: {limits}"


def test_a_program_writes_to_its_home_and_opens_what_its_groups_open(swarm: LabSwarm, spec: Path) -> None:
    until(lambda: "opens" in swarm.shell("k3-pi", "ls /home/robot"), "it does not open the camera alone")


def test_any_command_runs_in_the_namespace_of_its_robot(swarm: LabSwarm, spec: Path) -> None:
    until(
        lambda: TEXT in swarm.shell("k3-pi", "cat /home/robot/k3-pi-k3.csv || true"),
        "nothing is recorded",
    )


def test_a_node_gets_lists_files_and_folders_of_packages(swarm: LabSwarm, spec: Path) -> None:
    get = f"{SOURCE}; for one in place limits/upper sizes/low; do rosparam get /k3/shout/$one; done"
    until(lambda: "/usr/share/shouting/map" in swarm.shell("k3-pi", f"{get} || true"), "no parameters")
    assert "- 3\n- 4" in swarm.shell("k3-pi", get)
    assert "- 1\n- 2" in swarm.shell("k3-pi", get)
    written = swarm.shell("k3-pi", "cat /opt/swarm/newswarm/current/files/shout/greeting.txt")
    assert written.startswith("k3-pi of koala")


@pytest.mark.slow
def test_a_oneshot_ends_and_its_exit_code_is_checked(swarm: LabSwarm, spec: Path) -> None:
    until(lambda: "hello" in greeting(swarm), "the oneshot did not run")
    assert "ROS_NAMESPACE=/k3/hall" in swarm.shell("k3-pi", "cat /home/robot/greet")
    until(lambda: "failed" in state_of(swarm, "once"), "the other one did not fail")
    assert state_of(swarm, "greet") == "active exited"
    shown = swarm.swarmctl("status", spec=spec)
    assert "once: failed: exit-code" in shown.out, shown.out
    assert "greet:" not in shown.out
    assert "greet" in shown.out


def greeting(swarm: LabSwarm) -> str:
    return swarm.shell("k3-pi", f"{SOURCE}; rosparam get /k3/hall/greeting 2>/dev/null || true")


def state_of(swarm: LabSwarm, program: str) -> str:
    unit = f"swarm-newswarm.{program}.service"
    shown = swarm.shell("k3-pi", f"systemctl show -p ActiveState -p SubState --value {unit}")
    return " ".join(shown.split())


@pytest.mark.slow
def test_an_interactive_program_has_what_is_typed_and_its_code(swarm: LabSwarm, spec: Path) -> None:
    run = "echo yes | /opt/swarm/newswarm/current/bin/by-hand; echo code $?"
    shown = swarm.shell("k3-pi", run)
    assert "one /k3/by_hand typed yes" in shown
    assert "code 3" in shown


@pytest.mark.slow
def test_a_program_can_be_launched_by_hand(swarm: LabSwarm, spec: Path) -> None:
    swarm.shell("k3-pi", "sudo systemctl stop swarm-newswarm.shout")
    launch = f"{SOURCE}; timeout -s INT 6 roslaunch /opt/swarm/newswarm/current/launch/shout.launch"
    swarm.shell("k3-pi", f"({launch}) >/dev/null 2>&1 & sleep 3")
    assert TEXT in received(swarm)


def test_a_node_that_dies_is_started_again(swarm: LabSwarm, spec: Path, promise: Promise) -> None:
    until(lambda: TEXT in received(swarm), "the program is not received")
    before = node_process(swarm)
    swarm.shell("k3-pi", f"sudo kill -KILL {before}")
    seconds = until(lambda: node_process(swarm) not in ("", before), "the node does not come back")
    promise("a program's node is back after it died", seconds, 20)
    until(lambda: TEXT in received(swarm), "the node that came back is not received")


def node_process(swarm: LabSwarm) -> str:
    return swarm.shell("k3-pi", "pgrep -f '[s]hout.py .*__name:=shout' || true").strip()
