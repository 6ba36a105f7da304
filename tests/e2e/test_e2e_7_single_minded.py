"""Mode single-minded: one host drives every robot, over serial lines and Bluetooth."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from labswarm import LabSwarm, lab_of, moves, within

SPEC = """\
version: 1
name: newswarm
mode: single-minded
leader: laptop
hosts:
  laptop: {address: 192.168.77.10, user: robot, computer: laptop, bluetooth: [hci0]}
robots:
  koala: {type: koala}
  k3: {type: khepera3}
  epuck: {type: epuck}
links:
  - {kind: serial, host: laptop, robot: koala, usb: {serial: A600dXyz}, baud: 115200}
  - {kind: serial, host: laptop, robot: k3, usb: {serial: FTDI1234}}
  - {kind: bluetooth, host: laptop, robot: epuck, mac: "10:00:e8:c5:64:37", pin: {secret: epuck-pin}}
"""
SPEEDS = {"koala": 0.2, "k3": 0.1, "epuck": 0.05}


@pytest.fixture(scope="module")
def alone(workplace: Path) -> Iterator[LabSwarm]:
    """A lab of one host, beside the shared one and at the same address."""
    spec = workplace / "single-minded.yaml"
    spec.write_text(SPEC)
    folder = workplace / "alone"
    folder.mkdir()
    with lab_of(f"alone-{os.getpid()}", spec, folder) as swarm:
        yield swarm


def test_the_leader_drives_every_robot(alone: LabSwarm) -> None:
    deploy = alone.deploy()
    assert deploy.status == 0, deploy.out + deploy.err
    assert set(alone.units("laptop")) == {"master", "koala", "k3", "epuck", "epuck.rfcomm"}
    assert alone.plan().status == 0
    with ExitStack() as stack:
        for robot, speed in SPEEDS.items():
            stack.enter_context(alone.publishing("laptop", robot, speed))
        within(20, lambda: all(map(moves, alone.robots().values())), "not every robot moves")
        for robot, state in alone.robots().items():
            assert state["v"] == pytest.approx(SPEEDS[robot], rel=0.05)
    alone.seconds_to_standstill(*SPEEDS)
