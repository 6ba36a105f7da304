"""In every mode, the driver treats a program's commands as `validate` predicts."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from swarm_onboard.command.authority import Authority, Sender
from swarm_onboard.driver.config import parse

from swarmctl.linter.runner import lint
from swarmctl.render.driver_config import parameters
from swarmctl.spec.load import load
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import SwarmctlDriver

SPEC = """\
version: 1
name: pair
mode: {mode}
{role}
time: {{root: laptop}}
hosts:
  laptop: {{address: 192.168.77.10, computer: laptop}}
  k3-pi: {{address: 192.168.77.11, computer: raspberry-pi-3b}}
robots:
  koala: {{type: koala, host: laptop}}
  k3: {{type: khepera3, host: {k3_host}}}
links:
  - {{kind: wlan, name: lab, hosts: [laptop, k3-pi], multicast: true}}
  - {{kind: serial, host: laptop, robot: koala, usb: {{serial: A600dXyz}}}}
  - {{kind: serial, host: {k3_host}, robot: k3, usb: {{serial: FTDI1234}}}}
programs:
  wander:
    {place}
    package: wander
    executable: wander.py
    publishes: [{{topic: /k3/cmd_vel, type: geometry_msgs/Twist, rate: 10.0}}]
{control}
"""
ROLES = {
    "single-minded": "leader: laptop",
    "leader": "leader: laptop",
    "central": "hub: laptop",
    "standalone": "",
}
PLACES = ("host: laptop", "host: k3-pi", "robot: k3", "robot: koala")
CONTROLS = ("", *(f"control: [{{by: {by}, of: [k3]}}]" for by in ("laptop", "k3-pi", "koala", "wander")))


@pytest.mark.parametrize("mode", ROLES)
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("control", CONTROLS)
def test_a_program_is_refused_by_the_rule_where_the_driver_refuses_it(
    tmp_path: Path, mode: str, place: str, control: str
) -> None:
    k3_host = "laptop" if mode == "single-minded" else "k3-pi"
    path = tmp_path / "swarm.yaml"
    path.write_text(
        SPEC.format(mode=mode, role=ROLES[mode], k3_host=k3_host, place=place, control=control), "utf-8"
    )
    document, _ = load([path])
    assert document is not None
    refused = {one.code for one in lint(document)} & {"AUTH004"}
    swarm = resolve(document)
    program = swarm.programs["wander"]
    k3 = swarm.robots["k3"]
    assert isinstance(k3.driver, SwarmctlDriver)
    config = parse(yaml.safe_load(parameters(k3, k3.driver)[0]))
    authority = Authority(config.commanders, config.command_timeout)
    admitted = authority.admits(Sender(program.node, swarm.hosts[program.host].address), 0.0)
    assert admitted is not bool(refused)
