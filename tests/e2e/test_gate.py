"""Drivers of vendors behind their gates, deployed: only who may command moves a robot, however a gate ends.

The lab's stand-ins obey their last command for ever.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from tests.child_process import child_process
from tests.e2e.gated import CART, DESK, EXECUTED, PI, SPEED, Gated, recovers
from tests.e2e.lab_swarm import SOURCE, SWARM, LabSwarm, lab_of, moves, quoted, until
from tests.e2e.node_ends import BACK, ends_and_is_back
from tests.timing import PATIENCE, Promise

pytestmark = pytest.mark.slow

LAUNCHED, UNGATED = "burger", "free"
REASON = "the vendor's console arbitrates"
PILOT = f"swarm-{SWARM}.pilot.service"
TOP = 0.15  # m/s of the burger, as its settings have it; its stand-in would do 0.22
WISH = (0.3, 0.6)  # m/s and rad/s that the pilot commands
WHEELS = (0.126, 0.174)  # m/s, left and right: half the wish, on the same curve
KILLED = 1.2  # s: send_zero.py takes at most 1.0 s; the true state is 0.1 s old, and ssh takes its time
HUNG = 2.8  # s: its watchdog of 1 s, which systemd rounds by up to 0.25 s, then as for a killed gate
NOT_A_NUMBER = 0.6  # s: a stop at once; the true state is 0.1 s old, and ssh takes its time
SPEC = f"""\
version: 1
name: {SWARM}
mode: central
hub: {DESK}
hosts:
  {DESK}: {{address: 192.168.77.10, user: robot}}
  {PI}: {{address: 192.168.77.11, user: robot}}
types:
{CART}robots:
  {LAUNCHED}: {{type: turtlebot3-burger, host: {PI}, settings: {{limits: {{linear: {TOP}}}}}}}
  {EXECUTED}: {{type: cart, host: {PI}}}
  {UNGATED}:
    type: cart
    host: {PI}
    driver:
      package: cart_driver
      executable: cart_node
      ungated: true
      reason: {REASON}
      publishes: [{{topic: odom, type: nav_msgs/Odometry, rate: 10.0}}]
links:
  - {{kind: wlan, name: air, hosts: [{DESK}, {PI}]}}
programs:
  pilot:
    host: {DESK}
    package: piloting
    executable: pilot
control:
  - {{by: pilot, of: [{LAUNCHED}, {EXECUTED}]}}
"""
#: Robots whose vendors take commands in other ways, by what the spec says of their drivers.
VARIANTS = f"""\
  nested:
    type: vendor
    host: {PI}
    driver: {{package: vendors, launch: nested.launch, command: base/cmd_vel}}
  stamped:
    type: vendor
    host: {PI}
    driver:
      package: vendors
      executable: takes
      args: [~cmd_vel, TwistStamped]
      command: ~cmd_vel
      command_type: geometry_msgs/TwistStamped
  absolute:
    type: vendor
    host: {PI}
    driver: {{package: vendors, launch: absolute.launch, command: /cmd_vel}}
  stray: {{type: vendor, host: {PI}, driver: {{package: vendors, launch: stray.launch}}}}
"""
VENDOR = """\
  vendor:
    title: Robot of a vendor whose driver is a script of this test
    driver: {package: vendors, executable: takes}
    kinematics: {kind: differential, linear_max: 0.5, angular_max: 2.0}
"""
#: A driver: ``takes TOPIC TYPE`` writes the forward speed of each command to ~/ROBOT.
TAKES = """#!/usr/bin/env python3
import os, sys, rospy
from geometry_msgs import msg
def take(got):
    twist = getattr(got, "twist", got)
    with open(os.path.expanduser("~/") + rospy.get_namespace().split("/")[1], "a") as log:
        log.write("%g\\n" % twist.linear.x)
rospy.init_node("takes")
rospy.Subscriber(sys.argv[1], getattr(msg, sys.argv[2]), take)
rospy.spin()
"""
LAUNCHES = {
    "nested": '<group ns="base"><node pkg="vendors" type="takes" name="core" args="cmd_vel Twist"/></group>',
    "absolute": '<node pkg="vendors" type="takes" name="core" args="/cmd_vel Twist"/>',
    "stray": '<node pkg="vendors" type="takes" name="core" args="/stray_cmd_vel Twist"/>',
}
#: A commander that drives, then sends what is not a number; it prints a line in between.
ODD = f"""
import rospy, time
from geometry_msgs.msg import Twist
rospy.init_node("odd", anonymous=True)
out, twist = rospy.Publisher("/{EXECUTED}/cmd_vel", Twist, queue_size=1), Twist()
def send(seconds, x, z):
    twist.linear.x, twist.angular.z = float(x), float(z)
    for _ in range(int(20 * seconds)):
        out.publish(twist)
        time.sleep(0.05)
send(4, {SPEED}, 0)
print("odd", flush=True)
for x, z in (("nan", 0), ("inf", 0), (0.2, "nan"), (0.2, "-inf"), (1e300, 0)):
    send(0.5, x, z)
"""
FOLDER, VENDORS = "/usr/share/piloting", "/usr/share/vendors"
PACKAGE = """<package format="2"><name>piloting</name><version>1.0.0</version>
<description>drives</description><maintainer email="a@b.example">a</maintainer><license>BSD</license>
</package>"""
PROGRAM = f"""#!/bin/sh
exec rostopic pub -r 10 /{LAUNCHED}/cmd_vel geometry_msgs/Twist '[{WISH[0]}, 0, 0]' '[0, 0, {WISH[1]}]' "$@"
"""


@pytest.fixture(scope="module")
def fleet(workplace: Path) -> Iterator[LabSwarm]:
    spec = workplace / "vendors.yaml"
    spec.write_text(SPEC)
    with lab_of("e2e-gate", spec, workplace) as found:
        found.shell(
            DESK,
            f"sudo mkdir {FOLDER}; printf %s {quoted(PACKAGE)} | sudo tee {FOLDER}/package.xml >/dev/null; "
            f"printf %s {quoted(PROGRAM)} | sudo tee {FOLDER}/pilot >/dev/null; sudo chmod +x {FOLDER}/pilot",
        )
        found.shell(
            PI, f"sudo install -d -m 777 {VENDORS} {VENDORS}/launch; {written()} chmod +x {VENDORS}/takes"
        )
        run = found.deploy()
        assert run.status == 0, run.out + run.err
        yield found


def written() -> str:
    """The commands that write the vendors' package."""
    files = {"package.xml": PACKAGE.replace("piloting", "vendors"), "takes": TAKES}
    files |= {f"launch/{name}.launch": f"<launch>{text}</launch>" for name, text in LAUNCHES.items()}
    return " ".join(f"printf %s {quoted(text)} > {VENDORS}/{name};" for name, text in files.items())


def received(fleet: LabSwarm, robot: str) -> list[str]:
    """The speeds that the vendor's driver of ``robot`` was commanded."""
    return fleet.shell(PI, f"cat ~/{robot} || true").split()


@contextmanager
def without_pilot(fleet: LabSwarm) -> Iterator[None]:
    fleet.shell(DESK, f"sudo systemctl stop {PILOT}")
    fleet.seconds_to_standstill(LAUNCHED)
    yield
    fleet.shell(DESK, f"sudo systemctl start {PILOT}")
    until(lambda: moves(fleet.robot(LAUNCHED)), "the pilot's robot does not move again")


def contains(text: str, lines: list[str]) -> bool:
    return all(line in text for line in lines)


def test_a_fresh_deploy_is_healthy_and_its_pilot_drives(fleet: LabSwarm) -> None:
    until(lambda: moves(fleet.robot(LAUNCHED)), "the pilot's robot does not move")
    recovers(fleet)
    assert "commanded by pilot (/pilot)" in fleet.swarmctl("status").out
    found = fleet.swarmctl("history", "--commands", "--json").json()
    spans = [one for one in found["commands"] if one["event"] == "commanded"]
    assert {(one["robot"], one["commander"]) for one in spans} == {(LAUNCHED, "pilot")}
    assert {one["problem"] for one in found["records"]} == {""}


def test_the_limits_of_the_spec_hold_at_the_wheels(fleet: LabSwarm) -> None:
    until(lambda: moves(fleet.robot(LAUNCHED)), "the pilot's robot does not move")
    for _ in range(10):
        state = fleet.robot(LAUNCHED)
        assert (state["left"], state["right"]) == pytest.approx(WHEELS)
        time.sleep(0.05)


def test_a_stranger_moves_nothing_and_status_names_it(fleet: LabSwarm) -> None:
    robots = (LAUNCHED, EXECUTED)
    with (
        without_pilot(fleet),
        fleet.publishing(DESK, LAUNCHED, 0.77),
        fleet.publishing(DESK, EXECUTED, 0.77),
    ):
        before = fleet.robots()
        lines = [f"on 192.168.77.10 on /{robot}/cmd_vel; rejected by the gate" for robot in robots]
        until(lambda: contains(fleet.swarmctl("status").out, lines), "a refusal is not reported")
        for robot in robots:
            assert fleet.robot(robot)["distance"] == before[robot]["distance"]


class TestHoweverAGateEnds(Gated):
    """On ROS 1, where systemd runs a program that sends a zero."""

    KILLED = KILLED
    HUNG = HUNG


def test_gate_and_driver_run_again_however_they_end(fleet: LabSwarm, promise: Promise) -> None:
    ways = {"gate": "a clean exit", "driver": "rosnode kill"}
    for name, way in ways.items():
        part, node = f"{EXECUTED}.gate" if name == "gate" else EXECUTED, f"/{EXECUTED}/{name}"
        took = ends_and_is_back(fleet, PI, part, node, way)
        promise(f"{node} answers again after {way}", took, BACK)
    with fleet.driving(PI, EXECUTED, SPEED):
        pass
    fleet.seconds_to_standstill(EXECUTED)
    recovers(fleet)


def test_a_commander_that_sends_no_number_stops_the_robot(fleet: LabSwarm, promise: Promise) -> None:
    command = f"{SOURCE}; exec python3 -c {quoted(ODD)}"
    with child_process(fleet.shell_argv(PI, command), stdout=subprocess.PIPE) as commander:
        assert commander.stdout is not None
        until(lambda: moves(fleet.robot(EXECUTED)), f"{EXECUTED} does not move")
        assert commander.stdout.readline() == "odd\n"
        began = time.monotonic()
        fleet.seconds_to_standstill(EXECUTED)
        took = time.monotonic() - began
        place = fleet.robot(EXECUTED)["distance"]
        assert commander.wait(PATIENCE) == 0
    promise("cart of a vendor: NaN commanded, until it stands", took, NOT_A_NUMBER)
    assert fleet.robot(EXECUTED)["distance"] == place


def test_an_ungated_robot_obeys_anybody_and_has_its_reason(fleet: LabSwarm) -> None:
    with fleet.driving(DESK, UNGATED, SPEED):
        until(lambda: REASON in fleet.swarmctl("status").out, "status does not give the reason")
        run = fleet.swarmctl("status")
        assert f"/{UNGATED}/cmd_vel; rejected" not in run.out
        assert f"the driver obeys any publisher, as it is ungated: {REASON}" in run.out


def test_a_stop_through_a_gate_holds_and_is_proven_by_odometry(fleet: LabSwarm) -> None:
    until(lambda: moves(fleet.robot(LAUNCHED)), "the pilot's robot does not move")
    try:
        run = fleet.swarmctl("stop", "--json")
        found = {one["robot"]: (one["state"], one["proof"]) for one in run.json()["robots"]}
        assert found == {
            LAUNCHED: ("stands", "odometry"),
            EXECUTED: ("stands", "odometry"),
            UNGATED: ("failed", "none"),
        }
        assert run.status == exit_codes.HOSTS_FAILED
        fleet.seconds_to_standstill(LAUNCHED)
        fleet.shell(PI, f"sudo systemctl restart swarm-{SWARM}.{LAUNCHED}.gate.service")
        time.sleep(2)
        assert not moves(fleet.robot(LAUNCHED))
        assert fleet.swarmctl("stop", LAUNCHED).status == exit_codes.OK
        with fleet.publishing(PI, f"{EXECUTED}/gate", SPEED, rate=50):  # it is driven on past its gate
            until(lambda: moves(fleet.robot(EXECUTED)), "nothing passes the gate")
            run = fleet.swarmctl("stop", EXECUTED)
        assert run.status == exit_codes.NOT_PROVEN, run.out
        assert "it moves by its odometry" in run.out
    finally:
        assert fleet.swarmctl("start").status == exit_codes.OK
    until(lambda: moves(fleet.robot(LAUNCHED)), "the pilot's robot does not move again")


def test_vendors_take_commands_only_from_the_gate_or_are_named(fleet: LabSwarm) -> None:
    """Private, nested, absolute and stamped; last, one whose topic the spec does not know."""
    spec = fleet.variant("variants", ("robots:\n", VENDOR + "robots:\n" + VARIANTS))
    run = fleet.deploy(spec)
    assert run.status in (exit_codes.OK, exit_codes.UNHEALTHY), run.out + run.err
    line = "/stray/core takes commands on /stray_cmd_vel instead of /stray/gate/cmd_vel"
    until(lambda: line in fleet.swarmctl("status", spec=spec).out, "the stray driver is not named")
    run = fleet.swarmctl("status", spec=spec)
    assert run.status == exit_codes.UNHEALTHY
    assert "write `command: /stray_cmd_vel`" in run.out
    findings = fleet.swarmctl("status", "--json", spec=spec).json()["findings"]
    wrong = [one["subject"] for one in findings if one["check"] == "wiring" and one["state"] == "bad"]
    assert wrong == ["stray"]
    for robot in ("nested", "stamped", "absolute"):
        fleet.shell(PI, f"rm -f ~/{robot}")
        with fleet.publishing(PI, robot, 0.9):  # above its limit of 0.5
            until(lambda robot=robot: "0.5" in received(fleet, robot), f"{robot} is not commanded")
        assert set(received(fleet, robot)) <= {"0", "0.5"}
