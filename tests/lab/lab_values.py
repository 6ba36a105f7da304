"""Specs and plans for the lab's tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from swarmctl.lab.lab_plan import LabPlan, plan_of
from swarmctl.swarm.resolved import Swarm
from tests.loading import load_swarm

# A host with a user and one of root's, two networks, a robot on a cable and one on the radio.
SPEC = """\
version: 1
name: tiny
mode: leader
leader: alpha
hosts:
  alpha: {address: 10.91.1.1, user: robot}
  beta: {address: 10.91.1.2, user: root, port: 2222, bluetooth: [hci0]}
robots:
  rover: {type: khepera3, host: alpha}
  puck: {type: epuck, host: beta}
links:
  - {kind: wlan, name: air, hosts: [alpha, beta], multicast: false}
  - {kind: ethernet, name: wire, hosts: [alpha, beta], subnet: 10.91.2.0/24}
  - {kind: serial, host: alpha, robot: rover, usb: {serial: FTDI1234}}
  - {kind: bluetooth, host: beta, robot: puck, mac: "10:00:e8:c5:64:37", pin: {secret: puck-pin}}
"""


def plan_from(folder: Path, *changes: tuple[str, str], name: str | None = None) -> LabPlan:
    """The lab of ``SPEC`` with each text replaced by another."""
    return plan_of_text(folder, changed(*changes), name)


def with_distro(plan: LabPlan, distro: str) -> LabPlan:
    """The plan with this ROS distribution on all hosts, and without robots."""
    return replace(plan, hosts=tuple(replace(one, distro=distro) for one in plan.hosts), robots=())


def changed(*changes: tuple[str, str]) -> str:
    text = SPEC
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


def plan_of_text(folder: Path, text: str, name: str | None = None) -> LabPlan:
    return plan_of(swarm_from(folder, text), name)


def swarm_from(folder: Path, text: str) -> Swarm:
    spec = folder / "spec.yaml"
    spec.write_text(text)
    swarm, diagnostics = load_swarm(spec)
    assert swarm is not None, diagnostics
    return swarm
