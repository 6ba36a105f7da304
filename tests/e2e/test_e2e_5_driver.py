"""Drivers in trouble: whatever happens to one, its robot stands still, and the driver comes back."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack

import pytest
from labswarm import LEADER, LabSwarm, Note, Unit, at_once, moves, within

from swarmctl.lab import lab

WATCHDOG = 3
HOSTS = {"koala": "koala-laptop", "k3": "k3-pi", "epuck": "epuck-pi"}
SPEEDS = {"koala": 0.2, "k3": 0.1, "epuck": 0.05}


@pytest.fixture
def all_driving(swarm: LabSwarm) -> Iterator[LabSwarm]:
    """Every robot drives, as the leader orders, for as long as the test lasts."""
    with ExitStack() as stack:
        for robot, speed in SPEEDS.items():
            stack.enter_context(swarm.publishing(LEADER, robot, speed))
        within(15, lambda: all(map(moves, swarm.robots().values())), "not every robot moves")
        yield swarm


def drivers(swarm: LabSwarm) -> dict[str, Unit]:
    return {robot: swarm.units(host)[robot] for robot, host in HOSTS.items()}


def test_a_pulled_cable_costs_no_restart_and_the_robot_stands_before_it_obeys_again(
    swarm: LabSwarm, note: Note
) -> None:
    before = swarm.units("k3-pi")["k3"]
    with swarm.driving(LEADER, "k3", 0.1) as publisher:
        lab.unplug(swarm.name, "k3")
        said = swarm.diagnosis("epuck-pi", "k3")
        assert "level: 2" in said
        assert 'message: "/dev/swarm/k3 is missing: is the cable plugged in' in said
        lab.plug(swarm.name, "k3")
        stood = swarm.seconds_to_standstill("k3", within=6)["k3"]
        obeyed = within(6, lambda: moves(swarm.robot("k3")), "k3 does not obey fresh orders")
        note(
            "k3 after its cable was put back", f"stands {stood:.2f} s, obeys {stood + obeyed:.2f} s", "<= 6 s"
        )
        assert stood + obeyed <= 6

        lab.unplug(swarm.name, "k3")
        publisher.kill()
        assert moves(swarm.robot("k3"))  # the robot itself has no dead-man
        lab.plug(swarm.name, "k3")
        swarm.seconds_to_standstill("k3", within=6)
        place = swarm.robot("k3")["distance"]
        time.sleep(1)
        assert swarm.robot("k3")["distance"] == place
    after = swarm.units("k3-pi")["k3"]
    assert (after.pid, after.restarts) == (before.pid, before.restarts)


def test_a_killed_driver_leaves_its_robot_standing_and_comes_back(all_driving: LabSwarm, note: Note) -> None:
    swarm = all_driving
    before = drivers(swarm)

    def kill(robot: str) -> None:
        swarm.shell(HOSTS[robot], f"sudo kill -9 {before[robot].pid}")
        stood = swarm.seconds_to_standstill(robot)[robot]
        note(f"standstill of {robot} after SIGKILL of its driver", f"{stood:.2f} s", "<= 1 s")
        assert stood <= 1
        obeyed = within(15, lambda: moves(swarm.robot(robot)), f"{robot} does not obey its new driver")
        note(f"{robot} obeys its new driver after", f"{stood + obeyed:.2f} s", "")

    at_once([lambda robot=robot: kill(robot) for robot in HOSTS])
    for robot, unit in drivers(swarm).items():
        assert (unit.active, unit.restarts) == ("active", before[robot].restarts + 1)


def test_a_hung_driver_is_replaced_by_the_watchdog_and_its_robot_stopped(
    all_driving: LabSwarm, note: Note
) -> None:
    swarm = all_driving
    before = drivers(swarm)

    def hang(robot: str) -> None:
        start = swarm.robot(robot)["distance"]
        swarm.shell(HOSTS[robot], f"sudo kill -STOP {before[robot].pid}")
        stood = swarm.seconds_to_standstill(robot)[robot]
        overrun = swarm.robot(robot)["distance"] - start
        note(
            f"standstill of {robot} after SIGSTOP of its driver",
            f"{stood:.2f} s, {overrun:.2f} m",
            f"<= {WATCHDOG + 2} s",
        )
        assert stood <= WATCHDOG + 2
        within(15, lambda: moves(swarm.robot(robot)), f"{robot} does not obey its new driver")

    at_once([lambda robot=robot: hang(robot) for robot in HOSTS])
    for robot, unit in drivers(swarm).items():
        assert (unit.active, unit.restarts) == ("active", before[robot].restarts + 1)


def test_a_unit_stopped_by_hand_stops_its_robot_and_a_deploy_starts_it_again(
    all_driving: LabSwarm, note: Note
) -> None:
    swarm = all_driving
    began = time.monotonic()
    swarm.shell("k3-pi", "sudo systemctl stop swarm-newswarm.k3")
    assert not moves(swarm.robot("k3"))
    note("k3 stands and its unit has stopped after", f"{time.monotonic() - began:.2f} s", "")
    assert swarm.steps() == {"k3-pi": [("start", "swarm-newswarm.k3.service", "is inactive")]}
    assert swarm.deploy().status == 0
    within(15, lambda: moves(swarm.robot("k3")), "k3 does not obey its new driver")
