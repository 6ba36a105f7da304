"""ROS's own rosserial_python drives the rover's own firmware, as generated, on a simulated UNO.

The package is not Debian's: $SWARMCTL_WORKSPACE names built workspaces that hold it, divided by colons.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.lab import lab
from tests.e2e.lab_needs import workspace_with
from tests.e2e.lab_rover import (
    HOST,
    PULSE,
    ROBOT,
    SPEED,
    WHEELS,
    pulses,
    rover_lab,
)
from tests.e2e.lab_swarm import (
    SOURCE,
    LabSwarm,
    Note,
    SshError,
    until,
)
from tests.timing import Promise

STANDS = 1.1  # s: the gate's command_timeout of 0.5, a wheel that rolls out, and a look at the robot
TX_STOP = r"\377\376\000\000\377\013\000\364"


@pytest.fixture(scope="module")
def rover(workplace: Path) -> Iterator[LabSwarm]:
    workspace = workspace_with("rosserial_python", "rosserial_msgs")
    options = ("--workspace", workspace)
    with rover_lab("e2e-rospy", workplace, *options, driver="rosserial_python") as swarm:
        pulses(swarm, "lwheel")
        yield swarm


def silent(swarm: LabSwarm) -> bool:
    try:
        swarm.shell(HOST, f"{SOURCE}; timeout 2 rostopic echo -n 1 /{ROBOT}/lwheel")
    except SshError:
        return True
    return False


def speed_reached(swarm: LabSwarm) -> None:
    until(lambda: abs(swarm.robot(ROBOT)["v"] - SPEED) < 0.1 * SPEED, "the wheels do not reach it")


def test_commands_drive_it_and_both_wheels_are_counted(rover: LabSwarm) -> None:
    before, counted = rover.robot(ROBOT)["distance"], [pulses(rover, wheel) for wheel in WHEELS]
    with rover.publishing(HOST, ROBOT, SPEED):
        speed_reached(rover)
        time.sleep(2)
    rover.seconds_to_standstill(ROBOT)
    way = rover.robot(ROBOT)["distance"] - before
    for wheel, count in zip(WHEELS, counted, strict=True):
        assert (pulses(rover, wheel) - count) * PULSE == pytest.approx(way, abs=2 * PULSE, rel=0.05)


def test_silence_stops_it_by_its_gate(rover: LabSwarm, promise: Promise) -> None:
    with rover.publishing(HOST, ROBOT, SPEED) as publisher:
        speed_reached(rover)
        rover.shell(HOST, f"kill -9 {publisher.pid}")
        stood = rover.seconds_to_standstill(ROBOT)[ROBOT]
    promise("rosserial_python: the rover stands after its commander's death", stood, STANDS)


def test_a_board_that_is_plugged_in_again_is_driven_again(rover: LabSwarm, note: Note) -> None:
    """Opening its port resets it: it comes back with its counts at 0."""
    assert pulses(rover, "lwheel") > 0
    lab.unplug(rover.name, ROBOT)
    time.sleep(2)
    lab.plug(rover.name, ROBOT)
    began = time.monotonic()
    assert pulses(rover, "lwheel") == 0
    note("rosserial_python: cable back, until pulses come", f"{time.monotonic() - began:.1f} s", "")
    with rover.driving(HOST, ROBOT, SPEED):
        pass


def test_a_board_that_forgot_its_host_negotiates_again(rover: LabSwarm, note: Note) -> None:
    """A board restarted by its watchdog sends nothing until its topics are requested."""
    rover.shell(HOST, f"sudo sh -c \"printf '{TX_STOP}' > /dev/swarm/{ROBOT}\"")
    began = time.monotonic()
    assert silent(rover)
    pulses(rover, "lwheel")
    note("rosserial_python: board forgot it, until pulses come", f"{time.monotonic() - began:.1f} s", "")
    with rover.driving(HOST, ROBOT, SPEED):
        pass
