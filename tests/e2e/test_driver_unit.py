"""Drivers in trouble and back again. How soon robots stand is measured in test_dead_man.py."""

from __future__ import annotations

import time

from swarmctl.lab import lab
from tests.e2e.lab_swarm import LEADER, LabSwarm, moves, until
from tests.timing import Promise


def test_a_pulled_cable_restarts_nothing_and_stops_the_robot(swarm: LabSwarm, promise: Promise) -> None:
    before = swarm.units("k3-pi")["k3"]
    with swarm.driving(LEADER, "k3", 0.1) as publisher:
        lab.unplug(swarm.name, "k3")
        diagnosis = swarm.diagnosis("epuck-pi", "k3")
        assert "level: 2" in diagnosis
        assert 'message: "/dev/swarm/k3 is missing: is the cable plugged in' in diagnosis
        publisher.kill()
        assert moves(swarm.robot("k3"))  # the robot itself has no dead-man
        lab.plug(swarm.name, "k3")
        promise("k3 after its cable was put back: stands", swarm.seconds_to_standstill("k3")["k3"], 6)
        place = swarm.robot("k3")["distance"]
        time.sleep(1)
        assert swarm.robot("k3")["distance"] == place
    with swarm.driving(LEADER, "k3", 0.1):
        pass  # it obeys new commands
    after = swarm.units("k3-pi")["k3"]
    assert (after.pid, after.restarts) == (before.pid, before.restarts)


def test_a_unit_stopped_by_hand_is_started_by_the_next_deploy(swarm: LabSwarm) -> None:
    with swarm.driving(LEADER, "k3", 0.1):
        swarm.shell("k3-pi", "sudo systemctl stop swarm-newswarm.k3")
        assert not moves(swarm.robot("k3"))
        assert swarm.steps() == {"k3-pi": [("start", "swarm-newswarm.k3.service", "is inactive")]}
        assert swarm.deploy().status == 0
        until(lambda: moves(swarm.robot("k3")), "k3 does not obey its new driver")
