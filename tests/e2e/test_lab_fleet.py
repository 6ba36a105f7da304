"""Twelve hosts of the example `lab-fleet`, with robots of all kinds: deployed, healthy, driven by group."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

from tests import ROOT
from tests.child_process import child_process
from tests.e2e.lab_swarm import LabSwarm, lab_of, moves, until
from tests.e2e.ros_peers import roswtf, view
from tests.timing import PATIENCE, Promise

PART = "desk,host:tb3-[01-04],host:p3-[01-03],host:epuck-pi-1,host:rover-pi-[1-2],host:uav-pi"
GROUPS = {
    "turtles": ({"tb3-01", "tb3-02", "tb3-03", "tb3-04"}, (0.06, 0.14)),
    "pioneers": ({"p3-01", "p3-02", "p3-03"}, (0.143, 0.257)),
    "epucks": ({f"epuck-0{number}" for number in range(1, 7)}, (0.037, 0.063)),
    "rovers": ({"rover-1", "rover-2"}, (0.0675, 0.1325)),
}  # by group: its robots in the lab, and the speeds of their wheels in the circle, in m/s
HOSTS = 12
KINDS = ("desk", "tb3-01", "p3-01", "epuck-pi-1", "rover-pi-1", "uav-pi")  # a host of each kind
HOME = "/opt/swarm/lab-fleet/current"
SETUP = f"source {HOME}/setup.bash"


@pytest.fixture(scope="module")
def fleet(workplace: Path) -> Iterator[LabSwarm]:
    folder = workplace / "fleet"
    shutil.copytree(ROOT / "examples/lab-fleet", folder)
    with lab_of(f"fleet-{os.getpid()}", folder / "swarm.yaml", folder, "--only", PART) as swarm:
        done = swarm.deploy(None, "-f", str(folder / "lab.yaml"), "--limit", PART)
        assert done.status == 0, done.out + done.err
        assert f"{HOSTS} of {HOSTS} hosts changed" in done.out
        yield swarm


@contextmanager
def circling(swarm: LabSwarm, group: str) -> Iterator[None]:
    """The program of a group, as a person starts it at the desk, until its end."""
    command = f"timeout -s INT 60 {HOME}/bin/circle-{group}"
    nothing = subprocess.DEVNULL
    argv = swarm.shell_argv("desk", command)
    with child_process(argv, stdin=nothing, stdout=nothing, stderr=nothing) as process:
        try:
            yield
        finally:
            swarm.shell("desk", "pkill -INT -f '[c]ircle.py' || true")
            process.wait(PATIENCE)


def test_all_of_it_is_healthy(fleet: LabSwarm, promise: Promise) -> None:
    def status() -> tuple[int, str]:
        run = fleet.swarmctl("status", "-f", str(fleet.folder / "lab.yaml"), "--limit", PART)
        return run.status, run.out + run.err

    seconds = until(lambda: status()[0] == 0, "the fleet is not healthy")
    promise(f"a fleet of {HOSTS} hosts is healthy after its deploy", seconds, 40)


def test_roswtf_finds_no_fault(fleet: LabSwarm) -> None:
    assert roswtf(fleet, HOME, KINDS) == {}


@pytest.mark.slow
def test_all_robots_stand_on_one_map_for_rviz(fleet: LabSwarm) -> None:
    seen = view(fleet, "desk", HOME)
    assert {child: found for child, found in seen.parents.items() if len(found) != 1} == {}
    robots = {name.replace("-", "_") for group, _ in GROUPS.values() for name in group}
    assert {robot: seen.root_of(f"{robot}/base_link") for robot in robots} == dict.fromkeys(robots, "map")
    wheels = [f"{robot[1:]}/{joint}_link" for robot, joints in seen.joints.items() for joint in joints]
    assert set(wheels) - set(seen.parents) == set(), "wheels without a transform"
    assert len(wheels) == 16  # of six e-pucks and two rovers: swarmctl's driver describes them
    assert "swarm.rviz" in " ".join(seen.arguments)


def test_the_master_has_the_urdf_of_the_cart(fleet: LabSwarm) -> None:
    shown = yaml.safe_load(fleet.shell("desk", f"{SETUP}; rosparam get /cart/robot_description"))
    assert shown == (ROOT / "examples/lab-fleet/urdf/cart.urdf").read_text("utf-8")


@pytest.mark.parametrize("group", GROUPS)
def test_the_program_of_a_group_drives_it_and_nobody_else(fleet: LabSwarm, group: str) -> None:
    driven, wheels = GROUPS[group]
    with circling(fleet, group):
        until(lambda: moving(fleet) >= driven, f"not all {group} move")
        time.sleep(1.0)  # others would move by now
        states = fleet.robots()
        assert moving(fleet) == driven
        for robot in driven:
            assert (states[robot]["left"], states[robot]["right"]) == pytest.approx(wheels, abs=0.01), robot
    until(lambda: not moving(fleet), f"{group} do not stop with their program")


def moving(swarm: LabSwarm) -> set[str]:
    """The robots that truly move."""
    return {name for name, state in swarm.robots().items() if moves(state)}


def test_nobody_else_on_the_desk_is_obeyed(fleet: LabSwarm) -> None:
    with (
        fleet.publishing("desk", "p3_01", 0.2, source=SETUP),
        fleet.publishing("desk", "rover_1", 0.2, source=SETUP),
    ):
        time.sleep(3.0)  # they are connected within one
        assert moving(fleet) == set()
