"""`ros.ipv6`: hosts that have names and no IPv4 address drive, report health and bridge their masters."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.experiment import seconds_to_health
from tests.e2e.lab_swarm import LEADER, SOURCE, LabSwarm, Note, SshError, lab_of
from tests.e2e.test_naming import ALONE, LEADING, SPEC

RECEIVE = "timeout 6 rostopic echo -n 1 /k3/odom/header"
NAMES = (
    ("naming: hosts", "ipv6: true"),
    ("address: 192.168.77.10", "address: koala-laptop.lab"),
    ("address: 192.168.77.11", "address: k3-pi.lab"),
)


@pytest.fixture(scope="module")
def ipv6(workplace: Path) -> Iterator[LabSwarm]:
    folder = workplace / "ipv6"
    folder.mkdir()
    text = SPEC
    for old, new in NAMES:
        text = text.replace(old, new)
    (folder / "two.yaml").write_text(text)
    with lab_of(f"ipv6-{os.getpid()}", folder / "two.yaml", folder) as swarm:
        run = swarm.deploy()
        assert run.status == 0, run.out + run.err
        yield swarm


def test_nodes_of_hosts_without_ipv4_exchange_messages(ipv6: LabSwarm, note: Note) -> None:
    note("over IPv6 alone: healthy after the deploy", f"{seconds_to_health(ipv6):.1f} s", "")
    for host in ipv6.hosts:
        assert ipv6.shell(host, "ip -br -4 address show scope global") == ""
    with ipv6.driving(LEADER, "k3", 0.05):
        assert "seq:" in ipv6.shell(LEADER, f"{SOURCE}; {RECEIVE}")
    with pytest.raises(SshError):
        ipv6.shell(LEADER, f"{SOURCE}; unset ROS_IPV6; {RECEIVE}")
    ipv6.seconds_to_standstill("k3")


@pytest.mark.slow
def test_masters_bridge_their_topics(ipv6: LabSwarm) -> None:
    alone = ipv6.variant("alone", (LEADING, ALONE))
    run = ipv6.deploy(alone)
    assert run.status == 0, run.out + run.err
    seconds_to_health(ipv6, alone)
    with ipv6.driving(LEADER, "k3", 0.05):
        pass
    ipv6.seconds_to_standstill("k3")
