"""Hosts without an IPv4 address drive and report health: with `ros.ipv6`, and with ROS 2."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.e2e.experiment import seconds_to_health
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import LEADER, SOURCE, LabSwarm, Note, SshError, lab_of
from tests.e2e.test_naming import ALONE, LEADING, SPEC

RECEIVE = "timeout 6 rostopic echo -n 1 /k3/odom/header"
NAMES = (
    ("naming: hosts", "ipv6: true"),
    ("address: 192.168.77.10", "address: koala-laptop.lab"),
    ("address: 192.168.77.11", "address: k3-pi.lab"),
)
#: In ROS 2 no host is a commander; a person publishes as this node.
COMMANDER = """\
programs:
  ros2-topic-pub: {host: koala-laptop, package: p, executable: p, lifecycle: interactive, optional: true}
"""
ADDRESSES = (
    ("naming: hosts", "distro: jazzy"),
    ("address: 192.168.77.10", 'address: "fd00:77::10"'),
    ("address: 192.168.77.11", 'address: "fd00:77::11"'),
    (
        "control:\n  - {by: koala-laptop,",
        f"security: filtered\n{COMMANDER}control:\n  - {{by: ros2-topic-pub,",
    ),
)


@contextmanager
def deployed(folder: Path, changes: tuple[tuple[str, str], ...]) -> Iterator[LabSwarm]:
    folder.mkdir()
    text = SPEC
    for old, new in changes:
        text = text.replace(old, new)
    (folder / "two.yaml").write_text(text)
    skip_without_wheels(folder / "two.yaml")
    with lab_of(f"{folder.name}-{os.getpid()}", folder / "two.yaml", folder) as swarm:
        run = swarm.deploy()
        assert run.status == 0, run.out + run.err
        yield swarm


@pytest.fixture(scope="module")
def ipv6(workplace: Path) -> Iterator[LabSwarm]:
    with deployed(workplace / "ipv6", NAMES) as swarm:
        yield swarm


def test_nodes_of_ros_2_drive_over_ipv6_alone(workplace: Path, note: Note) -> None:
    with deployed(workplace / "ipv6-ros2", ADDRESSES) as swarm:
        note("ROS 2 over IPv6 alone: healthy after the deploy", f"{seconds_to_health(swarm):.1f} s", "")
        for host in swarm.hosts:
            assert swarm.shell(host, "ip -br -4 address show scope global") == ""
        with swarm.driving(LEADER, "k3", 0.05):
            pass
        swarm.seconds_to_standstill("k3")


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
