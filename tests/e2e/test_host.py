"""Hosts: they come back by themselves, a unit is kept from addresses, and people can launch by hand."""

from __future__ import annotations

import subprocess

import pytest

from tests.child_process import child_process
from tests.e2e.lab_swarm import (
    HOME,
    LEADER,
    SOURCE,
    LabSwarm,
    Note,
    until,
)
from tests.timing import PATIENCE


def test_a_rebooted_host_takes_up_its_part_by_itself(swarm: LabSwarm, note: Note) -> None:
    seconds = swarm.reboot("k3-pi")
    with swarm.driving(LEADER, "k3", 0.1):
        assert swarm.robot("k3")["v"] == pytest.approx(0.1, rel=0.05)
    swarm.seconds_to_standstill("k3")
    assert swarm.plan().status == 0
    note("k3-pi: reboot to SSH", f"{seconds:.1f} s", "")


def test_a_rebooted_hub_brings_its_master_and_every_robot_back(swarm: LabSwarm, note: Note) -> None:
    """rospy never joins a master anew: a driver unknown to its master ends, and systemd starts another."""
    swarm.reboot("koala-laptop")
    with swarm.driving(LEADER, "koala", 0.2):
        assert swarm.robot("koala")["v"] == pytest.approx(0.2, rel=0.05)
    swarm.seconds_to_standstill("koala")

    def known() -> bool:
        nodes = swarm.shell("koala-laptop", f"{SOURCE}; rosnode list").split()
        return all(f"/{robot}/driver" in nodes for robot in ("koala", "k3", "epuck"))

    until(known, "a driver does not join the new master")
    with swarm.driving(LEADER, "k3", 0.1):
        assert swarm.robot("k3")["v"] == pytest.approx(0.1, rel=0.05)
    swarm.seconds_to_standstill("k3")


def test_a_unit_that_is_denied_every_address_reaches_none(swarm: LabSwarm) -> None:
    sends = "import socket; socket.socket(type=socket.SOCK_DGRAM).sendto(b'x', ('192.168.77.10', 9))"
    command = f'sudo systemd-run --quiet --pipe --wait {{}} python3 -c "{sends}" 2>&1 || true'
    assert swarm.shell("k3-pi", command.format("")) == ""
    denied = swarm.shell("k3-pi", command.format("--property=IPAddressDeny=any"))
    assert "PermissionError" in denied


def test_the_launch_files_work_by_hand(swarm: LabSwarm) -> None:
    swarm.shell("k3-pi", "sudo systemctl stop swarm-newswarm.k3")
    command = f"{SOURCE}; echo $$; exec roslaunch {HOME}/current/launch/swarm.launch"
    argv = swarm.shell_argv("k3-pi", command)
    with child_process(argv, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as launch:
        assert launch.stdout is not None
        pid = int(launch.stdout.readline())
        with swarm.driving(LEADER, "k3", 0.1):
            assert swarm.robot("k3")["v"] == pytest.approx(0.1, rel=0.05)
        swarm.shell("k3-pi", f"kill -INT {pid}")
        launch.communicate(timeout=PATIENCE)
    swarm.seconds_to_standstill("k3")
    swarm.shell("k3-pi", "sudo systemctl start swarm-newswarm.k3")
    until(lambda: swarm.units("k3-pi")["k3"].active == "active", "the unit does not start again")
