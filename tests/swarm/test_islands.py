"""The five modes as islands and bridges, on one swarm of three robots."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.swarm.resolved import Bridge, Swarm
from tests.loading import load_swarm

BODY = """
hosts:
  laptop: {address: 192.168.77.10, computer: laptop}
  k3-pi: {address: 192.168.77.11, computer: raspberry-pi-2b, master_port: 11411}
  epuck-pi: {address: 192.168.77.12, computer: raspberry-pi-2b, bluetooth: [hci0]}
robots:
  koala: {type: koala, host: laptop}
  k3: {type: khepera3, host: k3-pi}
  epuck: {type: epuck, host: epuck-pi}
links:
  - {kind: wlan, name: lab, hosts: [laptop, k3-pi, epuck-pi], multicast: true}
  - {kind: serial, host: laptop, robot: koala, usb: {serial: A600dXyz}}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
  - {kind: bluetooth, host: epuck-pi, robot: epuck, mac: "10:00:e8:c5:64:37"}
programs:
  follow:
    robot: k3
    package: follow
    executable: follow.py
    subscribes: [{topic: /epuck/odom, type: nav_msgs/Odometry}]
control:
  - {by: koala, of: [koala, epuck]}
"""
COMBINED = """
islands:
  big: {mode: leader, leader: laptop, hosts: [laptop, epuck-pi]}
  small: {mode: central, hub: k3-pi, hosts: [k3-pi]}
multimaster: {topics: [{topic: /k3/odom, to: [big]}]}
"""


def swarm_in(tmp_path: Path, mode: str, more: str = "") -> Swarm:
    path = tmp_path / "swarm.yaml"
    path.write_text(f"version: 1\nname: three\nmode: {mode}\n{more}{BODY}", "utf-8")
    swarm, found = load_swarm(path)
    assert swarm is not None, found
    return swarm


@pytest.mark.parametrize(("mode", "role"), [("leader", "leader"), ("central", "hub")])
def test_one_master_for_all_hosts(tmp_path: Path, mode: str, role: str) -> None:
    swarm = swarm_in(tmp_path, mode, f"{role}: laptop\n")
    assert [(one.name, one.hub, one.hosts) for one in swarm.islands] == [
        ("three", "laptop", ("laptop", "k3-pi", "epuck-pi"))
    ]
    assert swarm.bridges == ()


def test_standalone_has_one_island_for_each_host(tmp_path: Path) -> None:
    swarm = swarm_in(tmp_path, "standalone")
    assert [(one.name, one.hub, one.hosts) for one in swarm.islands] == [
        (name, name, (name,)) for name in ("laptop", "k3-pi", "epuck-pi")
    ]
    assert swarm.master_uri(swarm.island_of("k3-pi")) == "http://192.168.77.11:11411"
    assert swarm.bridges == (
        Bridge("/epuck/cmd_vel", "geometry_msgs/Twist", "laptop", ("epuck-pi",), "control[0]"),
        Bridge("/epuck/odom", "nav_msgs/Odometry", "epuck-pi", ("k3-pi",), "programs.follow"),
    )


def test_combined_uses_the_declared_islands(tmp_path: Path) -> None:
    swarm = swarm_in(tmp_path, "combined", COMBINED)
    assert [(one.name, one.hub, one.hosts) for one in swarm.islands] == [
        ("big", "laptop", ("laptop", "epuck-pi")),
        ("small", "k3-pi", ("k3-pi",)),
    ]
    assert swarm.bridges == (
        Bridge("/epuck/odom", "nav_msgs/Odometry", "big", ("small",), "programs.follow"),
        Bridge("/k3/odom", "nav_msgs/Odometry", "small", ("big",), "multimaster.topics[0]"),
    )


def test_a_topic_is_bridged_from_every_publisher_to_others_only(tmp_path: Path) -> None:
    path = tmp_path / "swarm.yaml"
    camera = "package: cam, executable: cam, publishes: [{topic: /found, type: std_msgs/String}]"
    watch = "package: cam, executable: watch, subscribes: [{topic: /found, type: std_msgs/String}]"
    body = BODY.replace(
        "control:",
        f"  left: {{host: laptop, {camera}}}\n"
        f"  right: {{host: k3-pi, {camera}}}\n"
        f"  here: {{host: laptop, {watch}}}\n"
        f"  away: {{host: epuck-pi, {watch}}}\n"
        "control:",
    )
    path.write_text(f"version: 1\nname: three\nmode: standalone\n{body}", "utf-8")
    swarm, found = load_swarm(path)
    assert swarm is not None, found
    assert [(one.origin, one.to, one.cause) for one in swarm.bridges if one.topic == "/found"] == [
        ("laptop", ("epuck-pi",), "programs.away"),
        ("k3-pi", ("epuck-pi",), "programs.away"),
    ]
