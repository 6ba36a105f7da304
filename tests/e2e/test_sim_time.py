"""Simulated time, deployed: nodes have the clock of a program, and robots stop where that clock stands."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import SOURCE, SWARM, LabSwarm, lab_of, moves, until

DESK, OWN, VENDOR = "desk", "k3", "burger"
UNIT, PILOTS = f"swarm-{SWARM}.clock.service", f"swarm-{SWARM}.pilot.service"
TIME, RESTART = f"simulated time {DESK}", f"sudo systemctl restart swarm-{SWARM}.master.service"
START = 1000  # s; the clock of the program when it starts
CLOCK = f"""#!/usr/bin/env python3
import time
import rospy
from rosgraph_msgs.msg import Clock
rospy.init_node("clock", disable_rostime=True)
publisher = rospy.Publisher("/clock", Clock, queue_size=1)
begun = time.monotonic()
while not rospy.is_shutdown():
    publisher.publish(Clock(rospy.Time.from_sec({START} + time.monotonic() - begun)))
    time.sleep(0.02)
"""
PILOT = "rostopic pub -r 10 /{}/cmd_vel geometry_msgs/Twist '[0.05, 0, 0]' '[0, 0, 0]'"
SPEC = f"""\
version: 1
name: {SWARM}
mode: central
hub: {DESK}
ros: {{use_sim_time: true}}
hosts:
  {DESK}: {{address: 192.168.77.10, user: robot}}
robots:
  {OWN}: {{type: khepera3, host: {DESK}, namespace: lab/{OWN}}}
  {VENDOR}: {{type: turtlebot3-burger, host: {DESK}, namespace: lab/{VENDOR}}}
links:
  - {{kind: serial, host: {DESK}, robot: {OWN}, usb: {{serial: FTDI1234}}}}
programs:
  clock:
    host: {DESK}
    command: [python3, "{{files}}/clock.py"]
    files: {{clock.py: clock.py}}
    publishes: [{{topic: /clock, type: rosgraph_msgs/Clock, rate: 50.0}}]
  pilot:
    host: {DESK}
    command: [bash, -c, "{PILOT.format(f"lab/{OWN}")} & {PILOT.format(f"lab/{VENDOR}")}"]
control:
  - {{by: pilot, of: [{OWN}, {VENDOR}]}}
"""


@pytest.fixture(scope="module")
def simulated(workplace: Path) -> Iterator[LabSwarm]:
    spec = workplace / "simulated.yaml"
    spec.write_text(SPEC)
    (workplace / "clock.py").write_text(CLOCK)
    with lab_of("e2e-sim-time", spec, workplace) as found:
        run = found.deploy()
        assert run.status == 0, run.out + run.err
        yield found


def troubles(swarm: LabSwarm) -> dict[str, dict[str, Any]]:
    """Every bad finding of ``status``, by its key."""
    run = swarm.swarmctl("status", "--json")
    assert run.status == exit_codes.UNHEALTHY, run.out + run.err
    return {one["key"]: one for one in run.json()["findings"] if one["state"] == "bad"}


def healthy(swarm: LabSwarm) -> bool:
    run = swarm.swarmctl("status")
    print(run.out)  # a failure shows what was wrong
    return run.status == 0


def both_move(swarm: LabSwarm) -> bool:
    return all(moves(swarm.robot(name)) for name in (OWN, VENDOR))


def stamp(swarm: LabSwarm, robot: str) -> int:
    """Returns the stamp of a new odometry message, in whole seconds."""
    echo = f"timeout 10 rostopic echo -n 1 /lab/{robot}/odom/header/stamp/secs"
    return int(swarm.shell(DESK, f"{SOURCE}; {echo}").split()[0])


def test_robots_have_the_time_of_the_clock(simulated: LabSwarm) -> None:
    until(lambda: both_move(simulated), "the robots do not move")
    for robot in (OWN, VENDOR):
        assert START <= stamp(simulated, robot) < START + 600
    until(lambda: healthy(simulated), "the swarm does not become healthy")


@pytest.mark.slow
def test_dead_men_stop_robots_while_the_clock_stands_still(simulated: LabSwarm) -> None:
    """Commands and odometry go on without the clock; where commands end, so do the robots."""
    simulated.shell(DESK, f"sudo systemctl kill --signal=STOP {UNIT}")
    first = stamp(simulated, OWN)
    assert stamp(simulated, OWN) == first
    assert both_move(simulated)
    found = troubles(simulated)
    assert found["program clock"]["cause"] is None
    assert found[TIME]["cause"] == "program clock"
    simulated.shell(DESK, f"sudo systemctl stop {PILOTS}")
    simulated.seconds_to_standstill(OWN, VENDOR)
    simulated.shell(DESK, f"sudo systemctl kill --signal=CONT {UNIT}; sudo systemctl start {PILOTS}")
    until(lambda: both_move(simulated), "the robots do not move again")


@pytest.mark.slow
def test_a_restarted_master_has_simulated_time_again(simulated: LabSwarm) -> None:
    simulated.shell(DESK, f"{SOURCE}; rosparam set /use_sim_time false")
    found = troubles(simulated)[TIME]
    assert "/use_sim_time is not true" in found["message"]
    assert found["hint"].startswith(f"on {DESK}: {RESTART}")
    simulated.shell(DESK, RESTART)
    until(lambda: both_move(simulated), "the robots do not move after the restart")
    until(lambda: START <= stamp(simulated, OWN) < START + 1200, "the stamps are not of the new clock")
    until(lambda: healthy(simulated), "the swarm does not become healthy again")
