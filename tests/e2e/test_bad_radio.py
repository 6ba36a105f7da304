"""Twenty robots on a bad Wi-Fi."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest

from tests.e2e import bad_radio
from tests.e2e.lab_swarm import LabSwarm, Note, lab_of

pytestmark = pytest.mark.slow
HOSTS = 20
LOSS, MBIT, DELAY = 0.02, 8, 0.1  # of each direction: 200 ms there and back
SPEC = f"""\
version: 1
name: newswarm
mode: central
hub: pi-01
hosts:
  pi-[01-{HOSTS}]: {{address: "192.168.77.[101-{100 + HOSTS}]", user: robot}}
robots:
  k3-[01-{HOSTS}]: {{type: khepera3, host: "pi-[01-{HOSTS}]"}}
links:
  - {{kind: wlan, name: lab, hosts: ["pi-[01-{HOSTS}]"]}}
  - {{kind: serial, host: "pi-[01-{HOSTS}]", robot: "k3-[01-{HOSTS}]", usb: {{serial: "FTDI[01-{HOSTS}]"}}}}
"""


@pytest.fixture(scope="module")
def twenty(workplace: Path) -> Iterator[LabSwarm]:
    spec = workplace / "twenty.yaml"
    spec.write_text(SPEC)
    folder = workplace / "twenty"
    folder.mkdir()
    with lab_of(f"radio-{os.getpid()}", spec, folder) as swarm:
        yield swarm


@pytest.mark.parametrize("delay", [0.0, DELAY], ids=["near", "far"])
def test_a_first_deploy_of_20_hosts_is_confirmed_by_all(twenty: LabSwarm, note: Note, delay: float) -> None:
    bad_radio.spoil(twenty, loss=LOSS, mbit=MBIT)
    try:
        with bad_radio.delay(twenty, delay) if delay else nullcontext():
            deployed = twenty.timed_deploy()
    finally:
        bad_radio.repair(twenty)
    assert deployed.status == 0, deployed.out + deployed.err
    assert f"{HOSTS} of {HOSTS} hosts changed" in deployed.out
    assert twenty.plan().status == 0
    note(
        f"first deploy of {HOSTS} hosts, {LOSS:.0%} loss, {MBIT} Mbit/s, {2 * delay:g} s delay",
        f"{deployed.seconds:.1f} s",
        "",
    )
    assert twenty.swarmctl("remove", "--yes").status == 0
