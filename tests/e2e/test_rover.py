"""The rover's own firmware on a simulated UNO in the lab: commands at the ROS end become PWM and metres."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.lab import lab
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
    HOME,
    LabSwarm,
    Note,
    moves,
    until,
)
from tests.e2e.pose import Pose, wrapped
from tests.e2e.ros_peers import roswtf
from tests.timing import Promise

SIDE = 2.0  # m
TURN = 1.2  # rad/s
STANDS = 1.2  # s: the driver's dead-man, a wheel that rolls out, and a look at the robot
PAGE, FIRST = "64008046", ("64008046ffcf", "640080460c94")  # STK500v1 as hex: a page; that of the start
GOOD = 0.05  # of the way: how far odometry may be off


@pytest.fixture(scope="module")
def rover(workplace: Path) -> Iterator[LabSwarm]:
    with rover_lab("e2e-rover", workplace) as swarm:
        until(lambda: "standing still" in swarm.diagnosis(HOST, ROBOT), "the driver is not ready")
        yield swarm


def driven(swarm: LabSwarm, linear: float, angular: float, arrived: Callable[[Pose, Pose], bool]) -> None:
    """Commands until ``arrived`` is true of the first and the present pose; then waits until it stands."""
    start = swarm.truth(ROBOT)
    with swarm.publishing(HOST, ROBOT, linear, angular):
        until(lambda: arrived(start, swarm.truth(ROBOT)), "the rover does not get there")
    swarm.seconds_to_standstill(ROBOT)


def counts(swarm: LabSwarm) -> int:
    """Of both wheels, as the board published them; a turn on the spot cancels out."""
    return sum(pulses(swarm, wheel) for wheel in WHEELS)


def far(start: Pose, now: Pose) -> bool:
    return math.hypot(now.x - start.x, now.y - start.y) >= SIDE - 0.1


def turned(start: Pose, now: Pose) -> bool:
    return abs(wrapped(now.theta - start.theta)) >= math.radians(75)


def test_roswtf_finds_no_fault(rover: LabSwarm) -> None:
    assert roswtf(rover, f"{HOME}/current") == {}


@pytest.mark.slow
def test_commands_at_the_ros_end_drive_a_square_and_odometry_agrees(rover: LabSwarm, note: Note) -> None:
    truth, odometry = rover.truth(ROBOT), rover.odometry(HOST, ROBOT)
    before, counted = rover.robot(ROBOT)["distance"], counts(rover)
    off = []
    for _ in range(4):
        driven(rover, SPEED, 0.0, far)
        driven(rover, 0.0, TURN, turned)
        true, believed = rover.truth(ROBOT).seen_from(truth), rover.odometry(HOST, ROBOT).seen_from(odometry)
        off.append(math.hypot(true.x - believed.x, true.y - believed.y))
    way = rover.robot(ROBOT)["distance"] - before
    places = ", ".join(f"{one:.2f}" for one in off)
    note(f"odometry's places along a square, {way:.1f} m", f"{places} m off", f"{GOOD * way:.2f}")
    assert way > 3.5 * SIDE
    assert (counts(rover) - counted) * PULSE / 2 == pytest.approx(way, rel=GOOD)
    assert off[-1] <= GOOD * way


def test_silence_stops_it(rover: LabSwarm, promise: Promise) -> None:
    with rover.publishing(HOST, ROBOT, SPEED, 0.0) as publisher:
        until(lambda: abs(rover.robot(ROBOT)["v"] - SPEED) < 0.1 * SPEED, "the wheels do not reach it")
        rover.shell(HOST, f"kill -9 {publisher.pid}")
        stood = rover.seconds_to_standstill(ROBOT)[ROBOT]
    promise("the rover stands after its commander's death", stood, STANDS)


def test_the_driver_knows_the_firmware_that_the_spec_renders(rover: LabSwarm) -> None:
    [built] = rover.run("firmware", "build", str(rover.spec), "--json").json()["firmware"]
    diagnostics = rover.diagnosis(HOST, ROBOT)
    assert built["digest"] in diagnostics
    assert "firmware flash" not in diagnostics


@pytest.fixture(scope="module")
def other(rover: LabSwarm) -> Path:
    """The spec with another gain, deployed: now the board's sketch is not the spec's."""
    spec = rover.variant(
        "other-gain", ("driver: swarmctl}", "driver: swarmctl, settings: {firmware: {kp: 5.0}}}")
    )
    run = rover.deploy(spec)
    assert run.status == exit_codes.OK, run.out + run.err
    return spec


def test_a_sketch_that_is_not_the_specs_is_reported(rover: LabSwarm, other: Path) -> None:
    message = f"the spec makes {digest(rover, other)}: `swarmctl firmware flash` brings it"
    until(lambda: message in unfolded(rover.diagnosis(HOST, ROBOT)), "it is not reported")
    assert message in unfolded(rover.swarmctl("status", spec=other).out)


def unfolded(text: str) -> str:
    """Without what YAML and narrow terminals do to long lines."""
    return " ".join(text.replace("\\", "").split())


def digest(swarm: LabSwarm, spec: Path) -> str:
    [built] = swarm.run("firmware", "build", str(spec), "--json").json()["firmware"]
    return str(built["digest"])


@pytest.mark.slow
def test_a_cable_pulled_during_a_flash_leaves_the_robot_standing(rover: LabSwarm, other: Path) -> None:
    with rover.begin("firmware flash", spec=other) as flashing:
        until(lambda: halfway(rover), "the board is not written")
        lab.unplug(rover.name, ROBOT)
        out, err = flashing.communicate(timeout=60)
    assert flashing.returncode == exit_codes.HOSTS_FAILED, out + err
    assert "/dev/swarm/rover vanished while the board was written" in out
    assert "it stands still until it is flashed again" in out
    assert rover.units(HOST)[ROBOT].active == "active"
    lab.plug(rover.name, ROBOT)
    with rover.publishing(HOST, ROBOT, SPEED, 0.0):
        end = time.monotonic() + 5
        while time.monotonic() < end:
            assert not moves(rover.robot(ROBOT))


def halfway(swarm: LabSwarm) -> bool:
    command = swarm.robot(ROBOT)["last_command"]
    return command.startswith(PAGE) and not command.startswith(FIRST)


@pytest.mark.slow
def test_the_next_flash_writes_the_sketch_and_the_robot_drives(
    rover: LabSwarm, other: Path, note: Note
) -> None:
    run = rover.swarmctl("firmware flash", spec=other)
    assert run.status == exit_codes.OK, run.out + run.err
    note("firmware flash, until the driver has received the new sketch", f"{run.seconds:.1f} s", "")
    assert f"runs firmware {digest(rover, other)}" in run.out
    until(lambda: digest(rover, other) in rover.diagnosis(HOST, ROBOT), "the driver does not know it")
    assert "firmware flash" not in rover.diagnosis(HOST, ROBOT)
    with rover.publishing(HOST, ROBOT, SPEED, 0.0):
        until(lambda: abs(rover.robot(ROBOT)["v"] - SPEED) < 0.1 * SPEED, "the wheels do not reach it")
    rover.seconds_to_standstill(ROBOT)
