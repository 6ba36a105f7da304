"""`ros.naming: hosts`: nodes go by their hosts' names, by /etc/hosts with Debian's own line in it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.experiment import seconds_to_health
from tests.e2e.lab_swarm import (
    LEADER,
    SOURCE,
    LabSwarm,
    Note,
    lab_of,
    until,
)

SPEC = """\
version: 1
name: newswarm
mode: leader
leader: koala-laptop
ros: {naming: hosts}
hosts:
  koala-laptop: {address: 192.168.77.10, user: robot, computer: laptop}
  k3-pi: {address: 192.168.77.11, user: robot, computer: raspberry-pi-3b}
robots:
  koala: {type: koala, host: koala-laptop}
  k3: {type: khepera3, host: k3-pi}
links:
  - {kind: wlan, name: lab, hosts: [koala-laptop, k3-pi]}
  - {kind: serial, host: koala-laptop, robot: koala, usb: {serial: A600dXyz}}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
control:
  - {by: koala-laptop, of: [koala, k3]}
"""
LEADING = "mode: leader\nleader: koala-laptop\n"
ALONE = "mode: standalone\ntime: {root: koala-laptop}\nmultimaster: {provider: static}\n"


@pytest.fixture(scope="module")
def named(workplace: Path) -> Iterator[LabSwarm]:
    folder = workplace / "named"
    folder.mkdir()
    (folder / "two.yaml").write_text(SPEC)
    with lab_of(f"named-{os.getpid()}", folder / "two.yaml", folder) as swarm:
        run = swarm.deploy()
        assert run.status == 0, run.out + run.err
        yield swarm


def test_nodes_go_by_names_that_mean_another_address_at_home(named: LabSwarm, note: Note) -> None:
    note("names in URIs: healthy after the deploy", f"{seconds_to_health(named):.1f} s", "")
    for host, robot in ((LEADER, "koala"), ("k3-pi", "k3")):
        assert named.shell(host, f"getent hosts {host}").startswith("127.0.1.1 ")
        for asking in named.hosts:
            output = named.shell(asking, f"{SOURCE}; rosnode info /{robot}/driver")
            assert f"contacting node http://{host}:" in output


def test_the_leader_drives_all_robots_and_a_stranger_none(named: LabSwarm) -> None:
    for robot in ("koala", "k3"):
        with named.driving(LEADER, robot, 0.05):
            pass
    named.seconds_to_standstill("koala", "k3")
    place = named.robot("k3")["distance"]
    with named.publishing("k3-pi", "k3", 0.05):
        refusal = "refuses /rostopic"
        until(lambda: refusal in named.diagnosis("k3-pi", "k3"), "nothing is refused")
        found = re.search(r"on (\S+) \(\d+ commands\): (.*)\"", named.diagnosis("k3-pi", "k3"))
        assert found is not None
        assert found.groups() == ("k3-pi", "not among its commanders koala-laptop")
    assert named.robot("k3")["distance"] == place


@pytest.mark.slow
def test_masters_meet_by_names_as_well(named: LabSwarm, note: Note) -> None:
    alone = named.variant("alone", (LEADING, ALONE))
    run = named.deploy(alone)
    assert run.status == 0, run.out + run.err
    note("two masters by names: healthy after the deploy", f"{seconds_to_health(named, alone):.1f} s", "")
    with named.driving(LEADER, "k3", 0.05):
        pass
    named.seconds_to_standstill("k3")
