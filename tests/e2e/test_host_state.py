"""What is wrong with a host itself is the first cause that ``status`` names, and goes with its repair."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

from tests.e2e.lab_swarm import HOME, LabSwarm
from tests.sizes import some_of
from tests.timing import Promise

HOST = "k3-pi"
MOUNTED = "sudo mkdir -p /mnt/small && sudo mount -t tmpfs -o {options} none /mnt/small"
SWAPPED = "sudo cp -a /opt/swarm/. /mnt/small && sudo mount --bind /mnt/small /opt/swarm"
UNMOUNTED = "sudo umount /opt/swarm; sudo umount /mnt/small; true"  # also where it is unmounted
RECORD = f"{HOME}/state/transaction.json"
DROP_IN = "/etc/systemd/system/swarm-newswarm.k3.service.d"
RESTARTED = "sudo systemctl daemon-reload && sudo systemctl restart swarm-newswarm.k3.service"
BOOT_LINK = "/etc/systemd/system/multi-user.target.wants/swarm-newswarm.target"


@dataclass(frozen=True)
class Case:
    """A fault, the first cause that is shown, and the repair: a command on the host, or a verb."""

    fault: str
    check: str
    message: str
    repair: str = ""
    verb: tuple[str, ...] = ()


CASES = {
    "a file that was edited": Case(
        f"sudo sed -i '$ a x: 1' {HOME}/current/params/k3.yaml",
        f"files {HOST}",
        "params/k3.yaml was changed on the host",
        verb=("deploy", "--overwrite-edits"),
    ),
    "a file that is gone": Case(
        f"sudo rm {HOME}/current/launch/swarm.launch",
        f"files {HOST}",
        "launch/swarm.launch is missing",
        verb=("deploy",),
    ),
    "the block in /etc/hosts that was edited": Case(
        "sudo sed -i s/192.168.77.10/192.168.77.99/ /etc/hosts",
        f"files {HOST}",
        "/etc/hosts: the swarm's block was changed on the host",
        verb=("deploy", "--overwrite-edits"),
    ),
    "no start at boot": Case(
        f"sudo rm {BOOT_LINK}",
        f"files {HOST}",
        "swarm-newswarm.target does not start at boot: its link is missing",
        verb=("deploy",),
    ),
    "an address that a drop-in overrides": Case(
        f"sudo mkdir -p {DROP_IN} && echo ROS_IP=10.9.9.9 | sudo tee /etc/wrong.env &&"
        f" printf '[Service]\\nEnvironmentFile=/etc/wrong.env\\n' | sudo tee {DROP_IN}/site.conf &&"
        f" {RESTARTED}",
        "environment k3",
        "ROS_IP is 10.9.9.9 instead of 192.168.77.11",
        f"sudo rm -rf {DROP_IN} && {RESTARTED} && sleep 3",
    ),
    "a disk that is full": Case(
        f"{MOUNTED.format(options='size=8m')} && {SWAPPED};"
        "sudo dd if=/dev/zero of=/opt/swarm/fill bs=64k 2>/dev/null; true",
        f"disk {HOST} /opt/swarm",
        "is full: 0 KiB free",
        UNMOUNTED,
    ),
    "a disk without inodes": Case(
        f"{MOUNTED.format(options='nr_inodes=1000')} && {SWAPPED};"
        "sudo sh -c 'i=0; while touch /opt/swarm/f$i 2>/dev/null; do i=$((i+1)); done'",
        f"disk {HOST} /opt/swarm",
        "has 0 inodes left",
        UNMOUNTED,
    ),
    "a file system that is read-only": Case(
        "sudo mount --bind /opt/swarm /opt/swarm && sudo mount -o remount,bind,ro /opt/swarm",
        f"disk {HOST} /opt/swarm",
        "is read-only",
        "sudo umount /opt/swarm; true",
    ),
    "a change that was left open": Case(
        f"""sudo sed -i 's/"state":"[a-z]*"/"state":"applying"/' {RECORD}""",
        f"change {HOST}",
        "was interrupted, and is neither finished nor undone",
        verb=("deploy",),
    ),
}

TAKEN = ("a file that was edited", "an address that a drop-in overrides", "a disk that is full")


@pytest.fixture
def hurt(swarm: LabSwarm) -> Iterator[Callable[[Case], None]]:
    """Brings a fault to the host, whose repair follows at the end of the test."""
    repairs = []

    def fault(case: Case) -> None:
        repairs.append(case.repair)
        swarm.shell(HOST, case.fault)

    yield fault
    for repair in filter(None, repairs):
        swarm.shell(HOST, repair)


@pytest.mark.parametrize("name", some_of(CASES, TAKEN))
def test_the_cause_stands_first_and_goes_with_its_repair(
    swarm: LabSwarm, hurt: Callable[[Case], None], promise: Promise, name: str
) -> None:
    case = CASES[name]
    hurt(case)
    seen = swarm.swarmctl("status", "--limit", HOST)
    assert seen.status == 5, seen.out
    first = next(line for line in seen.out.splitlines()[1:] if line)
    assert first.startswith(f"✗ {case.check}: "), seen.out
    assert case.message in first, seen.out
    promise(f"status names {name}", seen.seconds, 10)
    if case.verb:
        verb, *options = case.verb
        repaired = swarm.swarmctl(verb, "--yes", "--limit", HOST, *options)
        assert repaired.status == 0, repaired.out + repaired.err
    else:
        swarm.shell(HOST, case.repair)
    again = swarm.swarmctl("status", "--limit", HOST)
    assert again.status == 0, again.out
